# Common settings and the two functions by which every module is declared.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG")
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
if(PROJECT_IS_TOP_LEVEL)
  set_property(GLOBAL PROPERTY CTEST_TARGETS_ADDED 1) # no Nightly/Continuous dashboard targets
endif()

# s, after which a test hangs: the slowest needs a twentieth of it on a machine of its own.
set(WHIRL_TEST_LIMIT 1800)

find_program(WHIRL_CCACHE ccache)
if(WHIRL_CCACHE)
  # Paths below the source tree count as relative ones: two checkouts share their objects. The sloppiness is what a
  # precompiled header needs to be found again.
  set(CMAKE_CXX_COMPILER_LAUNCHER env "CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}" "CCACHE_SLOPPINESS=pch_defines,time_macros" "${WHIRL_CCACHE}")
  set(CMAKE_C_COMPILER_LAUNCHER ${CMAKE_CXX_COMPILER_LAUNCHER})
endif()
include(WhirlUnits)

find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)

# What a fault in the code may do is kept small: programs load anywhere, and their tables of functions become read-only
# before the first instruction of theirs. Code that is made for others (not -march=native) also ends at a smashed stack, at
# a copy beyond its buffer and at a jump to where no function begins; so does, in every build, the code that reads files,
# sockets and wires (WHIRL_GUARDED), which is not the code that has to be fast.
include(CheckCXXCompilerFlag)
include(CheckPIESupported)
check_pie_supported()
check_cxx_compiler_flag(-fcf-protection WHIRL_HAS_CF_PROTECTION) # x86 only
check_cxx_compiler_flag(-fstack-clash-protection WHIRL_HAS_STACK_CLASH)
if(WHIRL_NATIVE)
  set(whirl_arch native)
  set(whirl_harden OFF)
else()
  set(whirl_arch "${WHIRL_ARCH}")
  set(whirl_harden ON)
endif()
option(WHIRL_HARDEN "Compile with checks of the stack and of copies" ${whirl_harden})
set(WHIRL_GUARDED io rt hardware monitor)

# A list of sanitizers has a comma, which a generator expression takes for the end of its argument.
set(sanitized OFF)
if(WHIRL_SANITIZE)
  set(sanitized ON)
endif()

add_library(whirl_flags INTERFACE)
target_link_options(whirl_flags INTERFACE $<BUILD_INTERFACE:-Wl,-z,relro,-z,now>)
add_library(whirl_guards INTERFACE)
target_compile_options(whirl_guards INTERFACE
  -fstack-protector-strong
  $<$<BOOL:${WHIRL_HAS_STACK_CLASH}>:-fstack-clash-protection>
  $<$<BOOL:${WHIRL_HAS_CF_PROTECTION}>:-fcf-protection>
  # It needs optimisation, and hides copies from the address sanitizer.
  $<$<NOT:$<OR:$<CONFIG:Debug>,$<BOOL:${sanitized}>>>:-U_FORTIFY_SOURCE$<SEMICOLON>-D_FORTIFY_SOURCE=2>)
if(WHIRL_HARDEN)
  target_link_libraries(whirl_flags INTERFACE $<BUILD_INTERFACE:whirl_guards>)
endif()
# One alignment for fixed-size Eigen types whatever the consumer's -march, so that the installed libraries keep their ABI.
target_compile_definitions(whirl_flags INTERFACE EIGEN_MAX_ALIGN_BYTES=64)
target_compile_options(whirl_flags INTERFACE
  $<BUILD_INTERFACE:-Wall> $<BUILD_INTERFACE:-Wextra> $<BUILD_INTERFACE:-Wshadow>
  # A source that is included by a unit is no header: its anonymous names stay in that unit.
  $<BUILD_INTERFACE:$<$<COMPILE_LANGUAGE:CXX>:-Wno-subobject-linkage>>
  # g++ 12 reports false positives of these three inside Eigen and std::string at -O2.
  $<BUILD_INTERFACE:-Wno-maybe-uninitialized> $<BUILD_INTERFACE:-Wno-stringop-overread>
  $<BUILD_INTERFACE:$<$<COMPILE_LANGUAGE:CXX>:-Wno-restrict>>
  $<BUILD_INTERFACE:$<$<BOOL:${WHIRL_WERROR}>:-Werror>>
  # The compiler looks for unused memory of its own less often: a tenth of the time of a unit with many templates.
  $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=524288>>
  # With AVX also inside its own intrinsics; the dev preset builds without and keeps both warnings.
  $<BUILD_INTERFACE:$<$<BOOL:${whirl_arch}>:-march=${whirl_arch}$<SEMICOLON>-Wno-uninitialized$<SEMICOLON>-Wno-array-bounds>>)
target_link_libraries(whirl_flags INTERFACE Eigen3::Eigen)
target_compile_features(whirl_flags INTERFACE cxx_std_20)
if(WHIRL_SANITIZE)
  target_compile_options(whirl_flags INTERFACE
    $<BUILD_INTERFACE:-fsanitize=${WHIRL_SANITIZE}> $<BUILD_INTERFACE:-fno-sanitize-recover=all>
    $<BUILD_INTERFACE:-fno-omit-frame-pointer>)
  target_link_options(whirl_flags INTERFACE $<BUILD_INTERFACE:-fsanitize=${WHIRL_SANITIZE}>)
endif()

if(WHIRL_TESTS)
  enable_testing()
  add_custom_target(whirl_all_tests)
  find_package(GTest REQUIRED)
  include(GoogleTest)
  set(WHIRL_DATA "${PROJECT_SOURCE_DIR}/../shared/data" CACHE PATH "Measured data for the reference tests")
endif()

# whirl_module(<name> [OWN_FLAGS] [USES <whirl modules>...] [LINKS <other targets>...])
# OWN_FLAGS: it sets compiler flags of its own, so that no precompiled header fits it. A library from src/*.cpp with its own include root, and one test program from test/*.cpp.
function(whirl_module name)
  cmake_parse_arguments(ARG "OWN_FLAGS" "" "USES;LINKS;PRIVATE_LINKS" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/src/*.cpp")
  list(TRANSFORM ARG_USES PREPEND whirl_)
  if(sources)
    whirl_units(units whirl_${name} ${sources})
    add_library(whirl_${name} STATIC ${units})
    set(scope PUBLIC)
    target_include_directories(whirl_${name} PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}/src")
    target_link_libraries(whirl_${name} PRIVATE ${ARG_PRIVATE_LINKS})
    set(kind library)
    if(name IN_LIST WHIRL_GUARDED)
      target_link_libraries(whirl_${name} PRIVATE $<BUILD_INTERFACE:whirl_guards>)
      set(kind guarded)
    endif()
    if(NOT ARG_OWN_FLAGS)
      whirl_precompile(whirl_${name} ${kind})
    endif()
  else()
    add_library(whirl_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(whirl::${name} ALIAS whirl_${name})
  set_property(GLOBAL APPEND PROPERTY WHIRL_MODULES ${name})
  target_include_directories(whirl_${name} ${scope}
    $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/internal> $<INSTALL_INTERFACE:include>)
  target_link_libraries(whirl_${name} ${scope} whirl_flags ${ARG_USES} ${ARG_LINKS})
  whirl_tests(whirl_${name}_test DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}/test" LINKS whirl_${name})
endfunction()

# whirl_tests(<target> DIRECTORY <dir> LINKS <targets>...)
# One GoogleTest program from every *.cpp below the directory. The kind of truth a test holds is the last word of its
# suite's name (FooReference, FooProperty, ...); it becomes the CTest label. Suites with no such word are `unit`.
set(WHIRL_TEST_KINDS Property Convergence Reference Realtime Export E2e)
function(whirl_tests target)
  cmake_parse_arguments(ARG "" "DIRECTORY" "LINKS;ARGS" ${ARGN})
  if(NOT WHIRL_TESTS)
    return()
  endif()
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${ARG_DIRECTORY}/*.cpp")
  if(NOT sources)
    return()
  endif()
  whirl_units(units ${target} ${sources})
  add_executable(${target} ${units})
  target_link_libraries(${target} PRIVATE ${ARG_LINKS} whirl_flags whirl_testing whirl_kept_memory GTest::gtest GTest::gmock GTest::gtest_main)
  whirl_precompile(${target} test)
  add_dependencies(whirl_all_tests ${target})
  set(not_unit "")
  foreach(kind ${WHIRL_TEST_KINDS})
    string(TOLOWER ${kind} label)
    gtest_discover_tests(${target} TEST_FILTER "*${kind}.*" TEST_LIST ${target}_${label} DISCOVERY_TIMEOUT 60
      DISCOVERY_MODE PRE_TEST NO_PRETTY_VALUES PROPERTIES LABELS ${label} TIMEOUT ${WHIRL_TEST_LIMIT})
    list(APPEND not_unit "*${kind}.*")
  endforeach()
  list(JOIN not_unit ":" not_unit)
  gtest_discover_tests(${target} TEST_FILTER "-${not_unit}" TEST_LIST ${target}_unit DISCOVERY_TIMEOUT 60
    DISCOVERY_MODE PRE_TEST NO_PRETTY_VALUES PROPERTIES LABELS unit TIMEOUT ${WHIRL_TEST_LIMIT})
endfunction()
