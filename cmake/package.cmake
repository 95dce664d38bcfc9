# Debian packages, made by deploy/package.sh: `tessera` (daemons, command, configuration), `libtessera-dev` (SDK) and
# `python3-tessera`.
install(FILES deploy/tessera.toml DESTINATION /etc/tessera COMPONENT configuration EXCLUDE_FROM_ALL)
install(DIRECTORY deploy/systemd/ DESTINATION lib/systemd/system COMPONENT configuration EXCLUDE_FROM_ALL)
install(FILES deploy/grafana/tessera.json deploy/keys.conf deploy/prometheus.yml
  DESTINATION ${CMAKE_INSTALL_DATADIR}/tessera COMPONENT configuration EXCLUDE_FROM_ALL)
install(DIRECTORY ${CMAKE_BINARY_DIR}/man DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT configuration EXCLUDE_FROM_ALL)
# bash looks for a file of the name of the command.
foreach(program tessera tessera-coordinator tessera-gateway tessera-ros tessera-sector-server tessera-viewer)
  install(FILES deploy/completion/tessera.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
    RENAME ${program} COMPONENT configuration EXCLUDE_FROM_ALL)
endforeach()
install(FILES docs/counters.md docs/operations.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/tessera
  COMPONENT configuration EXCLUDE_FROM_ALL)
# As pip installs it, by deploy/package.sh.
install(DIRECTORY ${CMAKE_BINARY_DIR}/python_package/ DESTINATION lib/python3/dist-packages COMPONENT python
  EXCLUDE_FROM_ALL PATTERN bin EXCLUDE)
install(PROGRAMS ${CMAKE_BINARY_DIR}/python_package/bin/tessera-record DESTINATION bin COMPONENT python
  EXCLUDE_FROM_ALL)
foreach(package tessera libtessera-dev python3-tessera)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} RENAME copyright
    COMPONENT license-${package} EXCLUDE_FROM_ALL)
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tessera)
set(CPACK_PACKAGE_CONTACT "Tessera <tessera@localhost>")
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/package)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL
  cluster configuration engines sdk python license-tessera license-libtessera-dev license-python3-tessera)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_CLUSTER_PACKAGE_NAME tessera)
set(CPACK_DEBIAN_CLUSTER_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_CLUSTER_PACKAGE_SUGGESTS etcd-server)
set(maintainer_files ${PROJECT_SOURCE_DIR}/deploy/debian)
set(CPACK_DEBIAN_CLUSTER_PACKAGE_CONTROL_EXTRA
  ${maintainer_files}/conffiles ${maintainer_files}/postinst ${maintainer_files}/prerm ${maintainer_files}/postrm)
set(CPACK_DEBIAN_SDK_PACKAGE_NAME libtessera-dev)
set(CPACK_DEBIAN_SDK_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_SDK_PACKAGE_DEPENDS "libabsl-dev, libeigen3-dev, libgrpc++-dev, libprotobuf-dev, libsleef-dev, libxxhash-dev")
# For the components `simulation`, whose engines are in the package `tessera`, and `world_files`.
set(CPACK_DEBIAN_SDK_PACKAGE_RECOMMENDS "libtbb-dev, tessera")
set(CPACK_DEBIAN_SDK_PACKAGE_SUGGESTS
  "libassimp-dev, libbullet-extras-dev, libconsole-bridge-dev, libpng-dev, libsdformat-dev, libtiff-dev, libtinyxml2-dev, nlohmann-json3-dev")
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-tessera)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
  "python3 (>= 3.11), python3 (<< 3.12), python3-grpcio, python3-numpy, python3-protobuf")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${maintainer_files}/python/postinst ${maintainer_files}/python/prerm)
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "python3-zstandard, tessera")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS python3-matplotlib)

include(CPack)
cpack_add_component_group(cluster
  DESCRIPTION "Rigid-body simulation in worlds of any size: daemons, command line, units, worlds")
cpack_add_component_group(sdk DESCRIPTION "Rigid-body simulation in worlds of any size: the C++ SDK, and the simulation to embed")
cpack_add_component_group(python
  DESCRIPTION "Rigid-body simulation in worlds of any size: worlds in a process of Python, and the client of clusters")
cpack_add_component(cluster GROUP cluster)
cpack_add_component(configuration GROUP cluster)
cpack_add_component(engines GROUP cluster)
cpack_add_component(license-tessera GROUP cluster)
cpack_add_component(sdk GROUP sdk)
cpack_add_component(license-libtessera-dev GROUP sdk)
cpack_add_component(python GROUP python)
cpack_add_component(license-python3-tessera GROUP python)
