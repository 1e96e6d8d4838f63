"""The paper's tables from one command: studies of many runs, done in any order, on one machine or several.

study       what is asked: tasks, arms, designs, seeds, steps; a folder with a frozen study.toml
jobs        what is to be done next, read off the folder; each job can be repeated without harm
spending    what a study may use of language models, shared among its jobs
pool        jobs in child processes of this machine
cluster     the same jobs on a Ray cluster
outcomes    what came out, one raw row a design
statistics  rates, intervals, differences
report      tables, curves and pictures on one page
"""
