# The README's commands. Everything real happens in CMake; this file installs what is missing and calls it.
#   make whirl       install dependencies, build the program alone
#   make reproduce   install dependencies, build, run the whole study, print where the report is
#   make check       build, run every test of less than 0.2 s; make check LIB=modal: one library, built and run alone
#   make test        install dependencies, build, run the test suite; tests of a library that passed run again only when
#                    what they depend on has changed; make test ALL=1: all of them
#   make evidence    print the tables of docs/validation*.md anew, those whose program or inputs changed; TABLE=name: one of them
#   make deb         build the Debian packages into build-deb/ (installs debhelper and mkdocs)
#   make release     all that is published into release/: archive, packages, wheel, bill of materials, checksums
#   make sanitize    the suite under AddressSanitizer and UndefinedBehaviorSanitizer;  make tsan: the threaded parts under ThreadSanitizer
#   make docs        API reference (Doxygen)
#   make tidy        .clang-tidy over every source (an hour of processor time; the suite checks the headers)
#   make deps        only install the Debian packages of packages.txt that are missing (the tests' own: packages-test.txt)
SHELL := /bin/bash
BUILD ?= build
OUT ?= out/reproduce
SEED ?= 1
JOBS ?= $(shell nproc)

.PHONY: all whirl deps deps-test configure build reproduce check test evidence sanitize tsan tidy docs deb release bench clean
all: build

deps:
	@tools/install-dependencies

deps-test:
	@tools/install-dependencies packages.txt packages-test.txt

# One configuration: whatever one of these builds, the others use.
configure: deps
	@cmake -S . -B $(BUILD) -G Ninja -DCMAKE_BUILD_TYPE=Release -DWHIRL_NATIVE=ON -DWHIRL_TESTS=ON -DWHIRL_WERROR=ON > $(BUILD).configure.log 2>&1 \
	  || { cat $(BUILD).configure.log; exit 1; }
	@rm -f $(BUILD).configure.log

build: configure
	@cmake --build $(BUILD) -j $(JOBS)

whirl: configure
	@cmake --build $(BUILD) -j $(JOBS) --target whirl
	@echo "$(BUILD)/bin/whirl"

reproduce: configure
	@cmake --build $(BUILD) -j $(JOBS) --target whirl
	@$(BUILD)/bin/whirl reproduce --out $(OUT) --seed $(SEED)

check: configure
	@cmake --build $(BUILD) -j $(JOBS) --target $(if $(LIB),whirl_$(LIB)_test,whirl_all_tests)
	@tools/check.py $(BUILD) $(if $(LIB),--lib $(LIB))

test: deps-test build
	@tools/suite.py $(BUILD) $$(( $(JOBS) + 1 )) $(if $(ALL),--all) # one test in ten waits more than it computes

evidence: deps
	@cmake -S . -B $(BUILD) -G Ninja -DCMAKE_BUILD_TYPE=Release -DWHIRL_NATIVE=ON -DWHIRL_TESTS=ON -DWHIRL_WERROR=ON -DWHIRL_BENCH=ON > /dev/null
	@tools/evidence.py $(BUILD) $(TABLE)

sanitize: deps-test
	@cmake --preset sanitize > /dev/null
	@cmake --build --preset sanitize -j $(JOBS)
	@ctest --preset sanitize -j $(JOBS)

deb:
	@tools/build-packages

release:
	@tools/release

tsan: deps-test
	@cmake --preset tsan > /dev/null
	@cmake --build --preset tsan -j $(JOBS)
	@for m in rt hardware monitor tuning; do echo "== $$m"; build-tsan/bin/whirl_$${m}_test --gtest_brief=1 || exit 1; done

docs: deps-test
	@mkdir -p $(BUILD)/api
	@(cat docs/api/Doxyfile; echo "OUTPUT_DIRECTORY = $(BUILD)/api") | doxygen -
	@echo "$(BUILD)/api/html/index.html"

tidy: deps-test
	@cmake --preset dev -DCMAKE_EXPORT_COMPILE_COMMANDS=ON > /dev/null
	@run-clang-tidy -quiet -p build-dev -j $(JOBS) '/(libs|apps)/.*/(src|commands)/'

bench: deps
	@cmake --preset dev > /dev/null
	@cmake --build --preset dev -j $(JOBS)
	@for b in build-dev/bin/bench_*; do echo "== $$b"; $$b || exit 1; done

clean:
	rm -rf build build-* out
