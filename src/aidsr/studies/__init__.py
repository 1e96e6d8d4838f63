"""Studies: experiments of many runs that reproduce the paper's tables with one command, on one or several machines.

benchmark   `aidsr.benchmark`: run a study, or resume it, and write its report
study       plan of a study (tasks, arms, designs, seeds, steps), frozen in the study.toml of its folder
jobs        pending jobs, derived from the contents of the folder; every job can safely be repeated
budget      limit on cost and tokens of language models, shared among the jobs
pool        execution of jobs in child processes on this machine
cluster     execution of jobs on a Ray cluster
outcomes    results, one row for each design
records     `aidsr.outcomes`: the same as plain records
statistics  means, intervals, differences
comparison  `aidsr.compare`: differences between two studies
report      tables, curves and pictures on one page
"""
