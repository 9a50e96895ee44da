"""The algorithms of the texts, each as its text has it, to compare with the library's own.

Nothing of the certified path uses them, and `import hizvk` does not load them.
Their names are reachable from `hizvk`, too.
"""

__all__: list[str] = []
