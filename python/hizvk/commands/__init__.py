"""What the commands share: arguments, reports as pages and JSON, figures.

- `arguments`: parsers with the common options; runs a command to its exit code
- `pipes`: ends quietly where nobody reads the output
- `page`: Markdown pages: headings, lists, tables, pictures
- `report`: report.md and report.json; adapter and versions in words
- `figure`: figures of matplotlib in one style
"""
