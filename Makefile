# Two commands for a stranger: `make demo` and `make test`.
.PHONY: setup
setup:
	@scripts/setup
