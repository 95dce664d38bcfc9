# Installs what other applications need: headers, libraries, a CMake package, a pkg-config file. The package has the
# components `client` (the C++ SDK, and the library for C), `simulation` (a world in the application's own process) and
# `world_files` (the reader of SDF, URDF and MJCF); each is a set of exported targets that depends on that of `model`.
include(CMakePackageConfigHelpers)

set(archives ${CMAKE_INSTALL_LIBDIR}/tessera)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/tessera)

# tessera_install(SET NAMES...): exports the targets tessera_NAME as tessera::NAME in one file of the package.
function(tessera_install set)
  set(targets)
  foreach(name ${ARGN})
    set_target_properties(tessera_${name} PROPERTIES EXPORT_NAME ${name})
    list(APPEND targets tessera_${name})
  endforeach()
  install(TARGETS ${targets} EXPORT tessera_${set}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT sdk
    ARCHIVE DESTINATION ${archives} COMPONENT sdk)
  install(EXPORT tessera_${set} FILE tessera_${set}.cmake NAMESPACE tessera:: DESTINATION ${package} COMPONENT sdk)
endfunction()

# What the others have in common: worlds as data.
set(model base grid ground joints model programs wasm)
tessera_install(model ${model})
tessera_install(client c client client_keys proto proto_grpc proto_messages proto_services)

# All other libraries of lpss/.
set(layer)
get_directory_property(targets DIRECTORY ${PROJECT_SOURCE_DIR}/lpss BUILDSYSTEM_TARGETS)
foreach(target ${targets})
  get_target_property(type ${target} TYPE)
  string(REGEX REPLACE "^tessera_" "" name ${target})
  if(type MATCHES "^(STATIC|INTERFACE)_LIBRARY$" AND NOT name IN_LIST model)
    list(APPEND layer ${name})
  endif()
endforeach()
tessera_install(simulation ${layer})
tessera_install(world_files settings_json tiles world_files)

target_include_directories(tessera_base INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_include_directories(tessera_c PUBLIC $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_compile_features(tessera_base INTERFACE cxx_std_20)
# The results do not depend on the application's compiler flags, and its executable finds the engines.
target_compile_options(tessera_simulation INTERFACE $<INSTALL_INTERFACE:-ffp-contract=off>)
target_link_options(tessera_simulation INTERFACE $<INSTALL_INTERFACE:-Wl,-rpath,$<INSTALL_PREFIX>/${archives}>)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/client_sdk/include/tessera
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT sdk)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/lpss DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT sdk
  FILES_MATCHING PATTERN "*.h" PATTERN bullet EXCLUDE PATTERN "*test*" EXCLUDE)
install(FILES ${PROJECT_SOURCE_DIR}/worlds/loader/look.h ${PROJECT_SOURCE_DIR}/worlds/loader/world_file.h
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/worlds/loader COMPONENT sdk)

set(generated ${CMAKE_CURRENT_BINARY_DIR}/package)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/tesseraConfig.cmake.in
  ${generated}/tesseraConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${generated}/tesseraConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${generated}/tesseraConfig.cmake ${generated}/tesseraConfigVersion.cmake
  DESTINATION ${package} COMPONENT sdk)
configure_file(${PROJECT_SOURCE_DIR}/cmake/tessera.pc.in ${generated}/tessera.pc @ONLY)
install(FILES ${generated}/tessera.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT sdk)
