"""Times the jobs of docs/jobs/ beside what is used for them today, and counts what each way misses.

``python -m tools.jobs driving`` prints one job's tables; without a name it prints all of them.
Ways are run in turns, and the best of some rounds counts.
Times depend on the machine; the counts do not, and tests compare them with the pages.
"""
