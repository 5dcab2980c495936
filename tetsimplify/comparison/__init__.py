"""What :func:`tetsimplify.compare.compare` is made of.

inputs and models: what is simplified. tasks: what is to be done. bench: doing it. apart and worker:
one run in a process of its own. measuring: what is told of its result. store: finished runs, and
the files of a report. tables: the terminal. table1: the table of the paper. page: the report for a
browser. machine: what it all ran on.
"""
