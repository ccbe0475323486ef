# whirl::whirl, the installed libraries with their headers, the package files for CMake and pkg-config, and the program.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

get_property(modules GLOBAL PROPERTY WHIRL_MODULES)
add_library(whirl_all INTERFACE)
add_library(whirl::whirl ALIAS whirl_all)
set_target_properties(whirl_all PROPERTIES EXPORT_NAME whirl)
target_include_directories(whirl_all INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
set(WHIRL_PC_LIBS "")
foreach(module ${modules})
  target_link_libraries(whirl_all INTERFACE whirl_${module})
  set_target_properties(whirl_${module} PROPERTIES EXPORT_NAME ${module})
  install(TARGETS whirl_${module} EXPORT whirl ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  # A library that only the program uses has no header for users, and git keeps no empty folder.
  if(IS_DIRECTORY "${PROJECT_SOURCE_DIR}/libs/${module}/include")
    install(DIRECTORY "${PROJECT_SOURCE_DIR}/libs/${module}/include/" DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  endif()
  get_target_property(type whirl_${module} TYPE)
  if(type STREQUAL "STATIC_LIBRARY")
    string(APPEND WHIRL_PC_LIBS " -lwhirl_${module}")
  endif()
endforeach()
install(DIRECTORY "${PROJECT_SOURCE_DIR}/include/" DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(TARGETS whirl_flags whirl_all EXPORT whirl)
if(TARGET whirl)
  install(TARGETS whirl RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

set(package "${CMAKE_INSTALL_LIBDIR}/cmake/whirl")
install(EXPORT whirl NAMESPACE whirl:: FILE whirlTargets.cmake DESTINATION ${package})
configure_package_config_file(cmake/WhirlConfig.cmake.in "${PROJECT_BINARY_DIR}/whirlConfig.cmake"
  INSTALL_DESTINATION ${package})
write_basic_package_version_file("${PROJECT_BINARY_DIR}/whirlConfigVersion.cmake" COMPATIBILITY SameMajorVersion)
install(FILES "${PROJECT_BINARY_DIR}/whirlConfig.cmake" "${PROJECT_BINARY_DIR}/whirlConfigVersion.cmake"
  DESTINATION ${package})
configure_file(cmake/whirl.pc.in "${PROJECT_BINARY_DIR}/whirl.pc" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/whirl.pc" DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
