# The program and the Python module once more, in a build of their own: one program cannot hold both, since the inline
# functions of Eigen and of the standard library would be shared, and the linker would take either's.
include(ExternalProject)
set(level x86-64-v3)
set(targets whirl)
if(TARGET whirl_python)
  list(APPEND targets whirl_python)
endif()
set(faster "${PROJECT_BINARY_DIR}/${level}")
ExternalProject_Add(whirl_${level}
  SOURCE_DIR "${PROJECT_SOURCE_DIR}"
  BINARY_DIR "${faster}"
  CMAKE_ARGS
    -DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE}
    "-DCMAKE_C_FLAGS=${CMAKE_C_FLAGS}" "-DCMAKE_CXX_FLAGS=${CMAKE_CXX_FLAGS}"
    "-DCMAKE_EXE_LINKER_FLAGS=${CMAKE_EXE_LINKER_FLAGS}" "-DCMAKE_MODULE_LINKER_FLAGS=${CMAKE_MODULE_LINKER_FLAGS}"
    -DCMAKE_DISABLE_FIND_PACKAGE_MPI=${CMAKE_DISABLE_FIND_PACKAGE_MPI}
    -DCMAKE_SKIP_RPATH=ON # copied as built: a path to the libraries of this machine would be installed with it
    -DWHIRL_ARCH=${level} -DWHIRL_NATIVE=OFF -DWHIRL_TESTS=OFF -DWHIRL_BENCH=OFF
    -DWHIRL_PYTHON=${WHIRL_PYTHON} "-DWHIRL_PYTHON_EXECUTABLE=${WHIRL_PYTHON_EXECUTABLE}"
  BUILD_COMMAND "${CMAKE_COMMAND}" --build "${faster}" --target ${targets}
  BUILD_ALWAYS ON
  USES_TERMINAL_BUILD ON # its own ninja is the only one at work
  INSTALL_COMMAND "")
ExternalProject_Add_StepDependencies(whirl_${level} build ${targets})

install(PROGRAMS "${faster}/bin/whirl" DESTINATION libexec/whirl/${level})
if(WHIRL_PYTHON_DIR AND TARGET whirl_python)
  install(DIRECTORY "${faster}/python/whirl/" DESTINATION ${WHIRL_PYTHON_DIR}/whirl/${level} FILES_MATCHING PATTERN "*.so")
endif()
