# Installs the SDK and the engines of `build` into a separate folder, builds the application in `source` against them,
# and compares its hash of `world` with that of `tessera run`.
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
