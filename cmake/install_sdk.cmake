# What an application outside of this tree needs of the SDK: headers, libraries, a CMake package, a pkg-config file.
include(CMakePackageConfigHelpers)

target_include_directories(tessera_client PUBLIC $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_include_directories(tessera_c PUBLIC $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_compile_features(tessera_client PUBLIC cxx_std_20)

# The client and what it is linked with, and the library for C, under their names in the namespace tessera::.
set(sdk base c client grid model proto proto_grpc proto_messages proto_services)
foreach(name ${sdk})
  set_target_properties(tessera_${name} PROPERTIES EXPORT_NAME ${name})
  list(APPEND sdk_targets tessera_${name})
endforeach()
install(TARGETS ${sdk_targets} EXPORT tesseraTargets
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT sdk
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/tessera COMPONENT sdk)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/client_sdk/include/tessera
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT sdk)
foreach(folder base grid model)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/lpss/${folder}
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lpss COMPONENT sdk FILES_MATCHING PATTERN "*.h")
endforeach()

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/tessera)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/tesseraConfig.cmake.in
  ${CMAKE_CURRENT_BINARY_DIR}/tesseraConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/tesseraConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/tesseraConfig.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/tesseraConfigVersion.cmake DESTINATION ${package} COMPONENT sdk)
configure_file(${PROJECT_SOURCE_DIR}/cmake/tessera.pc.in ${CMAKE_CURRENT_BINARY_DIR}/tessera.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/tessera.pc
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT sdk)
install(EXPORT tesseraTargets NAMESPACE tessera:: DESTINATION ${package} COMPONENT sdk)
