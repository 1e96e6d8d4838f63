# Every target does its own set-up. `make help` lists them.
VENV := .venv
PYTHON ?= python3
BIN := $(VENV)/bin
.DEFAULT_GOAL := help
.PHONY: help setup setup-dev check test test-slow demo docs clean bench-stability bench-builtin bench-learning bench-trial bench-rl corpus-report bench-validator fuzz tasks-study cheats attacks bench-fabrication film

help:  ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## (.*)/  make \1\t\2/' | expand -t 28

$(VENV)/core: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	@touch $@

$(VENV)/dev: $(VENV)/core
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[dev,fabrication,mcp,rl,web]"
	@touch $@

setup: $(VENV)/core  ## install AID-SR into .venv

setup-dev: $(VENV)/dev  ## the same with the development tools

check: $(VENV)/dev  ## format, lint, types, layer contracts
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test: $(VENV)/dev  ## run the tests
	$(BIN)/python -m pytest -m "not slow"

test-slow: $(VENV)/dev  ## run the tests that take minutes
	$(BIN)/python -m pytest -m slow

demo: $(VENV)/core  ## design three robots for button_pushing with the built-in rules; no key needed
	$(BIN)/aidsr design --task button_pushing --model builtin --seed 1

bench-stability: $(VENV)/core  ## share of built-in designs that end as stable scenes (minutes)
	$(BIN)/python benchmarks/stability/run.py

bench-builtin: $(VENV)/dev  ## train and evaluate built-in designs of every task missing in OUT.jsonl (many hours, resumable): STEPS=300000 DESIGNS=3 SEEDS=1 JOBS=2 OUT=results-version8
	$(BIN)/python benchmarks/builtin/table.py --steps $(or $(STEPS),300000) --designs $(or $(DESIGNS),3) --seeds $(or $(SEEDS),1) --jobs $(or $(JOBS),2) $(if $(OUT),--out $(OUT))

bench-rl: $(VENV)/dev  ## speed of stepping and learning, against Gymnasium environments in SubprocVecEnv (hours, resumable): RUNS=5 OUT=results
	$(BIN)/python benchmarks/rl/speed.py --runs $(or $(RUNS),5) --out $(or $(OUT),results)

bench-learning: $(VENV)/dev  ## what each training protocol reaches on the fixed suite (hours, resumable): HALF=aside STEPS=60000
	$(BIN)/python -m benchmarks.learning.compare --steps $(or $(STEPS),60000) $(if $(HALF),--half $(HALF))
	$(BIN)/python -m benchmarks.learning.probes
	$(BIN)/python -m benchmarks.learning.report

bench-trial: $(VENV)/dev  ## does a trial without learning tell which designs fail when trained (hours, resumable): HALF=aside
	$(BIN)/python -m benchmarks.trial.run training earlier trial short $(if $(HALF),--half $(HALF))
	$(BIN)/python -m benchmarks.trial.report

corpus-report: $(VENV)/core  ## precision and recall of the validator on robots of known faults (an hour, resumable): JOBS=2
	$(BIN)/python -m benchmarks.validator.report --processes $(or $(JOBS),2)

bench-validator: $(VENV)/core  ## time of a validation, against a plain loop over mj_step
	$(BIN)/python -m benchmarks.validator.speed

fuzz: $(VENV)/dev  ## give CASES=1000 broken documents to the validator, simulate BATTERY=50 of them; and TEXTS=200 broken texts to each parser
	$(BIN)/python -m benchmarks.validator.fuzz --cases $(or $(CASES),1000) --battery $(or $(BATTERY),50)
	AIDSR_FUZZ_CASES=$(or $(TEXTS),200) $(BIN)/python -m pytest -n 0 tests/test_foreign_texts.py

bench-fabrication: $(VENV)/dev  ## how many approved designs under RUNS=runs can be built, and why not the others: JOBS=2
	$(BIN)/python benchmarks/fabrication/run.py $(or $(RUNS),runs) --jobs $(or $(JOBS),2)

tasks-study: $(VENV)/core  ## what wins each task without a designed policy, and open-loop motions (hours, resumable)
	$(BIN)/python -m benchmarks.tasks.study

cheats: $(VENV)/dev  ## try robots that are no cable-driven soft bodies on every task, and show how each is refused (hours, resumable): STATIC=1 JOBS=2
	$(BIN)/python -m benchmarks.cheats.matrix --jobs $(or $(JOBS),2) $(if $(STATIC),--static)

attacks: $(VENV)/dev  ## kill every command, and attack it by servers, documents, replies, folders and requests (hours, resumable): ONLY=kills
	$(BIN)/python -m benchmarks.attacks.run $(if $(ONLY),--only $(ONLY))

film: $(VENV)/dev  ## make the film of the README again (minutes)
	rm -rf build/readme
	$(BIN)/aidsr design --task simple_grasping --seed 1 --runs build/readme
	$(BIN)/aidsr train build/readme/*/designs/1 --steps 60000 --protocol paper --from-probe
	$(BIN)/python benchmarks/readme/film.py build/readme/*/designs/1 docs/images/grasping.webp

docs: $(VENV)/dev  ## build the documentation into build/site
	$(BIN)/mkdocs build --strict --quiet

clean:  ## remove the virtual environment and caches
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache
