# The target `reference`: pages for the public headers, by Doxygen, and for the Python package, by pydoc. It fails on any
# warning of Doxygen. `deploy/build.sh release reference` installs what it needs; nothing else does.
find_program(TESSERA_DOXYGEN doxygen)
if(NOT TESSERA_DOXYGEN)
  return()
endif()
set(reference ${CMAKE_BINARY_DIR}/reference)
configure_file(${PROJECT_SOURCE_DIR}/docs/reference/Doxyfile.in ${CMAKE_BINARY_DIR}/Doxyfile @ONLY)
add_custom_target(reference
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${reference}
  COMMAND ${CMAKE_COMMAND} -E make_directory ${reference}/python
  COMMAND ${TESSERA_DOXYGEN} ${CMAKE_BINARY_DIR}/Doxyfile
  COMMAND ${TESSERA_PYTHON} -m pip install --quiet --no-index --no-build-isolation --no-deps --no-compile
          --target ${reference}/package ${PROJECT_SOURCE_DIR}/client_sdk/python
  COMMAND ${CMAKE_COMMAND} -E chdir ${reference}/python
          ${CMAKE_COMMAND} -E env PYTHONPATH=${reference}/package PYTHONDONTWRITEBYTECODE=1
          ${TESSERA_PYTHON} ${PROJECT_SOURCE_DIR}/docs/reference/python_pages.py
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${reference}/package
  COMMAND ${CMAKE_COMMAND} -E echo "C++ and C: ${reference}/cpp/index.html"
  COMMAND ${CMAKE_COMMAND} -E echo "Python: ${reference}/python/tessera.html"
  VERBATIM)
