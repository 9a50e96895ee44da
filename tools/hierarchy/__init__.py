"""Hierarchical visibility beside the flat list of meshlets: ``python -m tools.hierarchy``.

- ``compare`` prints the tables of ``docs/methods.md``.
- ``pictures FOLDER`` leaves the text's figures of a scene as PNG files.
"""
