# What `cmake --install` lays down: libraries, headers and the package that find_package(warmslip) reads.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/warmslip)

install(TARGETS warmslip_kernels warmslip_core EXPORT warmslip
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
        INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/warmslip DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
        FILES_MATCHING PATTERN "*.hpp")
install(EXPORT warmslip FILE warmslipTargets.cmake NAMESPACE warmslip:: DESTINATION ${package} COMPONENT development)

set(config ${CMAKE_CURRENT_BINARY_DIR}/warmslipConfig.cmake)
set(version ${CMAKE_CURRENT_BINARY_DIR}/warmslipConfigVersion.cmake)
configure_package_config_file(cmake/warmslipConfig.cmake.in ${config} INSTALL_DESTINATION ${package})
write_basic_package_version_file(${version} COMPATIBILITY SameMinorVersion)
install(FILES ${config} ${version} cmake/FindPETSc.cmake cmake/FindCHOLMOD.cmake
        DESTINATION ${package} COMPONENT development)
