# Two commands for a stranger: `make demo` and `make test`.
PORT ?= 8000

.PHONY: help setup demo test soak lint format
help:
	@echo "make demo [SCENE=model.glb] [PORT=8000]   bake a corridor and walk through it"
	@echo "make test                                 run every check and every test"
	@echo "make setup | lint | format | soak"

setup:
	@scripts/setup

demo:
	@scripts/setup demo
	@.venv/bin/farfield demo $(if $(SCENE),"$(SCENE)") --port $(PORT)

test:
	@scripts/setup
	@scripts/test

soak:
	@scripts/setup
	@scripts/soak

lint:
	@scripts/setup-python
	@.venv/bin/ruff format --check . && .venv/bin/ruff check . && .venv/bin/mypy

format:
	@scripts/setup-python
	@.venv/bin/ruff format . && .venv/bin/ruff check --fix .
