# Every recipe is one script in scripts/, which says what it does and why.
.DEFAULT_GOAL := help
# Arguments of the viewer or of gpu-check, such as ARGS='--scene arm' and ARGS=--quick.
ARGS ?=
.PHONY: help setup demo view bench-view test test-swiftshader soak lint bench bench-speed docs
.PHONY: wheel package gpu-check

help: ## This list
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | \
	  awk -F ':.*## ' '{printf "  make %-18s %s\n", $$1, $$2}'

setup: ## Install what is missing (system packages, .venv) and build the Python module
	@scripts/setup.sh

demo: ## Cull a real mountain scene on the GPU; leaves pictures and a report in out/
	@scripts/demo.sh

view: ## Open a window on a scene that is drawn from the lists; ARGS='--help' lists what it takes
	@scripts/view.sh $(ARGS)

test: ## All tests on Mesa's lavapipe (or on the driver that HIZVK_EXPECT_ADAPTER names)
	@scripts/test.sh

test-swiftshader: ## The same GPU tests on SwiftShader, a second software driver
	@scripts/test.sh swiftshader

soak: ## The tests that take minutes: millions of adversarial cases against the exact oracle
	@scripts/soak.sh

lint: ## Format, clippy, ruff, mypy --strict, stubtest, shellcheck
	@scripts/lint.sh

bench: ## Measure speed and error of every configuration; leaves report and plots in out/bench
	@scripts/bench.sh

bench-speed: ## Measure times against yardsticks and targets; leaves report and plot in out/speed
	@scripts/bench_speed.sh

gpu-check: ## Doctor, tests, speed and demo on this machine's GPU; one report in out/gpu
	@scripts/gpu_check.sh $(ARGS)

bench-view: ## Whole frames with and without culling, as a table
	@scripts/view.sh --bench $(ARGS)

docs: ## The HTML documentation, in docs/_build/html
	@scripts/docs.sh

wheel: ## sdist and manylinux wheel in dist/, tried in an empty virtual environment
	@scripts/wheel.sh

package: ## The crates' packages and the sdist, each unpacked and compiled in an empty folder
	@scripts/package.sh
