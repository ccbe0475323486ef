# Units of compilation. Most of the time of a unit goes into headers and into templates that its neighbours instantiate
# too. So headers of other projects are precompiled, and neighbouring sources are compiled as one unit of about
# WHIRL_UNIT_SIZE: `-DWHIRL_UNITS=OFF` compiles each source alone. Names in anonymous namespaces are therefore unique
# within a library.
option(WHIRL_UNITS "Compile neighbouring sources together" ON)
# Not in the cache: an older build folder would keep its value.
if(NOT DEFINED WHIRL_UNIT_SIZE)
  set(WHIRL_UNIT_SIZE 72000) # bytes of source; half of it for tests, which share less
endif()

# whirl_units(<out> <target> <sources>...)
# Writes files that include the sources in their order, by paths below the source tree so that checkouts share cached
# objects. A source that the compiler is to meet alone names it: `set_source_files_properties(... ALONE ON)`.
function(whirl_units out target)
  set(units "")
  set(batch "")
  set(size 0)
  set(number 0)
  set(folder "")
  set(sources ${ARGN})
  set(most ${WHIRL_UNIT_SIZE})
  if(target MATCHES "_test$")
    math(EXPR most "${WHIRL_UNIT_SIZE} / 2")
  endif()
  if(NOT WHIRL_UNITS)
    set(${out} ${sources} PARENT_SCOPE)
    return()
  endif()
  macro(end_unit)
    if(batch)
      math(EXPR number "${number} + 1")
      set(unit "${CMAKE_CURRENT_BINARY_DIR}/units/${target}_${number}.cpp")
      file(CONFIGURE OUTPUT "${unit}" CONTENT "${batch}" @ONLY)
      list(APPEND units "${unit}")
      set(batch "")
      set(size 0)
    endif()
  endmacro()
  foreach(source ${sources})
    get_source_file_property(alone "${source}" ALONE)
    if(alone)
      list(APPEND units "${source}")
      continue()
    endif()
    file(RELATIVE_PATH path "${PROJECT_SOURCE_DIR}" "${source}")
    get_filename_component(place "${path}" DIRECTORY)
    file(SIZE "${source}" bytes)
    math(EXPR half "2 * ${size}")
    math(EXPR total "${size} + ${bytes} / 2")
    if(total GREATER most OR (NOT place STREQUAL folder AND half GREATER most))
      end_unit()
    endif()
    string(APPEND batch "#include \"${path}\"\n")
    math(EXPR size "${size} + ${bytes}")
    set(folder "${place}")
  endforeach()
  end_unit()
  set_source_files_properties(${units} PROPERTIES INCLUDE_DIRECTORIES "${PROJECT_SOURCE_DIR}")
  set(${out} ${units} PARENT_SCOPE)
endfunction()

set(WHIRL_HEADERS <Eigen/Dense> <fmt/format.h> <algorithm> <array> <cmath> <complex> <filesystem> <fstream> <functional> <map>
    <memory> <numbers> <optional> <random> <set> <span> <sstream> <string> <string_view> <variant> <vector>
    "${PROJECT_SOURCE_DIR}/libs/core/internal/whirl/core/decompositions.hpp")
set(WHIRL_HEADERS_guarded <nlohmann/json.hpp>)
set(WHIRL_HEADERS_program <CLI/CLI.hpp>)
set(WHIRL_HEADERS_test <gmock/gmock.h> <gtest/gtest.h> "${PROJECT_SOURCE_DIR}/testing/include/whirl/testing/comparisons.hpp")
# Tests, commands and bindings run once for every time they are compiled: what takes time is in the libraries. Products and
# sums are contracted as there.
set(WHIRL_QUICKLY $<$<CONFIG:Release>:-O1> $<$<AND:$<CONFIG:Release>,$<CXX_COMPILER_ID:GNU>>:-fexpensive-optimizations>)
set(WHIRL_FLAGS_test ${WHIRL_QUICKLY})
set(WHIRL_FLAGS_program ${WHIRL_QUICKLY})

# whirl_precompile(<target> library|guarded|program|test)
# Compiles the headers of a kind once; targets of one kind have the same flags.
function(whirl_precompile target kind)
  set(owner whirl_headers_${kind})
  if(NOT TARGET ${owner})
    set(source "${PROJECT_BINARY_DIR}/headers.cpp")
    file(CONFIGURE OUTPUT "${source}" CONTENT "int main() {}\n")
    if(kind MATCHES "library|guarded|program")
      add_library(${owner} OBJECT "${source}")
    else()
      add_executable(${owner} EXCLUDE_FROM_ALL "${source}") # compiled as programs are
    endif()
    target_include_directories(${owner} PRIVATE "${PROJECT_SOURCE_DIR}/libs/core/internal")
    target_link_libraries(${owner} PRIVATE whirl_flags fmt::fmt $<$<STREQUAL:${kind},guarded>:whirl_guards>
      $<$<STREQUAL:${kind},program>:whirl_guards> $<$<STREQUAL:${kind},test>:GTest::gtest> $<$<STREQUAL:${kind},test>:GTest::gmock>)
    target_compile_options(${owner} PRIVATE ${WHIRL_FLAGS_${kind}})
    target_precompile_headers(${owner} PRIVATE ${WHIRL_HEADERS} ${WHIRL_HEADERS_${kind}})
  endif()
  target_compile_options(${target} PRIVATE ${WHIRL_FLAGS_${kind}})
  target_precompile_headers(${target} REUSE_FROM ${owner})
endfunction()
