# The README's commands. Everything real happens in CMake; this file installs what is missing and calls it.
#   make whirl       install dependencies, build the program alone
#   make reproduce   install dependencies, build, run the whole study, print where the report is
#   make test        install dependencies, build, run the whole test suite
#   make deb         build the Debian packages into build-deb/ (installs debhelper and mkdocs)
#   make sanitize    the suite under AddressSanitizer and UndefinedBehaviorSanitizer;  make tsan: the threaded parts under ThreadSanitizer
#   make docs        API reference (Doxygen)
#   make tidy        .clang-tidy over every source (an hour of processor time; the suite checks the headers)
#   make deps        only install the Debian packages of packages.txt that are missing (the tests' own: packages-test.txt)
SHELL := /bin/bash
BUILD ?= build
OUT ?= out/reproduce
SEED ?= 1
JOBS ?= $(shell nproc)

.PHONY: all whirl deps deps-test build reproduce test sanitize tsan tidy docs deb bench clean
all: build

deps:
	@tools/install-dependencies

deps-test:
	@tools/install-dependencies packages.txt packages-test.txt

build: deps
	@cmake -S . -B $(BUILD) -G Ninja -DCMAKE_BUILD_TYPE=Release -DWHIRL_NATIVE=ON -DWHIRL_TESTS=ON -DWHIRL_WERROR=ON > $(BUILD).configure.log 2>&1 \
	  || { cat $(BUILD).configure.log; exit 1; }
	@rm -f $(BUILD).configure.log
	@cmake --build $(BUILD) -j $(JOBS)

whirl: deps
	@cmake -S . -B $(BUILD) -G Ninja -DCMAKE_BUILD_TYPE=Release -DWHIRL_NATIVE=ON > /dev/null
	@cmake --build $(BUILD) -j $(JOBS) --target whirl
	@echo "$(BUILD)/bin/whirl"

reproduce: deps
	@cmake -S . -B $(BUILD) -G Ninja -DCMAKE_BUILD_TYPE=Release -DWHIRL_NATIVE=ON > /dev/null
	@cmake --build $(BUILD) -j $(JOBS) --target whirl
	@$(BUILD)/bin/whirl reproduce --out $(OUT) --seed $(SEED)

test: deps-test build
	@cd $(BUILD) && ctest --output-on-failure -j $(JOBS)

sanitize: deps-test
	@cmake --preset sanitize > /dev/null
	@cmake --build --preset sanitize -j $(JOBS)
	@ctest --preset sanitize -j $(JOBS)

deb:
	@tools/build-packages

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
