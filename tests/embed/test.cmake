# Installs the SDK and the engines of `build` into a separate folder, builds the application in `source` and the client
# `hello` against them, and compares the application's hash of `world` with that of `tessera run`.
function(must_run result)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY OUTPUT_VARIABLE said)
  set(${result} "${said}" PARENT_SCOPE)
endfunction()

set(folder ${build}/tests/embed)
file(REMOVE_RECURSE ${folder})
foreach(component sdk engines)
  must_run(said ${CMAKE_COMMAND} --install ${build} --prefix ${folder}/prefix --component ${component})
endforeach()
must_run(said ${CMAKE_COMMAND} -G Ninja -S ${source} -B ${folder}/build -D CMAKE_PREFIX_PATH=${folder}/prefix
  -D CMAKE_CXX_COMPILER=${compiler} -D CMAKE_CXX_FLAGS=${flags})
must_run(said ${CMAKE_COMMAND} --build ${folder}/build)

# The example of the C++ SDK, by CMake and by pkg-config.
must_run(said ${CMAKE_COMMAND} -G Ninja -S ${source}/client -B ${folder}/client -D CMAKE_PREFIX_PATH=${folder}/prefix
  -D CMAKE_CXX_COMPILER=${compiler} -D CMAKE_CXX_FLAGS=${flags} -D hello=${hello})
must_run(said ${CMAKE_COMMAND} --build ${folder}/client)
file(GLOB_RECURSE descriptions ${folder}/prefix/tessera.pc)
get_filename_component(descriptions ${descriptions} DIRECTORY)
must_run(said sh -c "PKG_CONFIG_PATH=${descriptions} && export PKG_CONFIG_PATH && ${compiler} ${flags} -std=c++20 \
  ${hello} $(pkg-config --cflags --libs tessera) -o ${folder}/by_pkg_config")

# A sanitizer calls dlopen() in place of the application, whose run path then does not count.
if(flags MATCHES "-fsanitize")
  file(GLOB_RECURSE engine ${folder}/prefix/libtessera-engine-f32.so)
  get_filename_component(engines ${engine} DIRECTORY)
  set(ENV{LD_LIBRARY_PATH} ${engines})
endif()
must_run(hash ${folder}/build/embed ${world} 60)
must_run(said ${build}/bin/tessera run ${world} --in-process --seconds 1 --json ${folder}/report.json)
file(READ ${folder}/report.json report)
string(JSON expected GET ${report} world_hash)
if(NOT hash STREQUAL expected)
  message(FATAL_ERROR "the application ends in ${hash}, tessera run in ${expected}")
endif()
