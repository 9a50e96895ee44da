"""What only developers run, from a checkout: no part of the package or its wheel."""
