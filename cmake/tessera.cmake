# How every target of the project is made: one library with an alias per folder, tests next to the code.

set(tessera_warnings -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wno-missing-field-initializers)
if(TESSERA_WERROR)
  list(APPEND tessera_warnings -Werror)
endif()

# What tests measure is in libraries: the tests themselves compile in three quarters of the time with -O1.
set(tessera_test_optimisation $<$<CONFIG:Release>:-O1>)

# Programs run several times slower under a sanitizer.
set(tessera_slowness 1)
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  set(tessera_slowness 5)
endif()

# The same bits on every machine: no contraction to fused multiply-add.
add_compile_options(-ffp-contract=off)

set(tessera_is_x86_64 OFF)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
  set(tessera_is_x86_64 ON)
else()
  # A char has a sign, as on x86-64. Notes on the ABI of GCC before 10 say nothing here.
  add_compile_options(-fsigned-char -Wno-psabi)
  # Whichever header of Eigen comes first, Core is ours.
  foreach(header Cholesky Dense Eigen Eigenvalues Geometry Householder Jacobi LU OrderingMethods QR SVD Sparse SparseCore)
    file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/eigen/Eigen/${header}
      CONTENT "#pragma once\n#include <Eigen/Core>\n#include_next <Eigen/${header}>\n")
  endforeach()
  include_directories(BEFORE ${PROJECT_SOURCE_DIR}/cmake/neon ${CMAKE_BINARY_DIR}/eigen)
endif()

# The compiler collects its garbage from 1 GiB on, which few files reach, and not again and again from 128 MiB on: a tenth
# of its time.
add_compile_options("$<$<COMPILE_LANG_AND_ID:CXX,GNU>:SHELL:--param ggc-min-heapsize=1048576>")

# The environment of tests that run as on a processor without FMA and AVX2, where the C library has other functions.
set(tessera_without_fma GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4)

# tessera_compile_fast(TARGET HEADERS): TARGET uses cmake/precompiled/HEADERS.h as a precompiled header, and its files are
# compiled in groups of up to tessera_group, or twelve of a program: most of the time goes into headers, and into templates
# that every file would instantiate. A file whose local names would clash with those of others has
# SKIP_UNITY_BUILD_INCLUSION.
set(tessera_group 12)
function(tessera_compile_fast target headers)
  if(NOT TESSERA_FAST_BUILD)
    return()
  endif()
  # GCC uses a precompiled header only with the same flags: programs are compiled like libraries.
  get_target_property(type ${target} TYPE)
  set(group ${tessera_group})
  if(type STREQUAL EXECUTABLE)
    set(group 12)
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
    target_compile_options(${target} PRIVATE -fPIC)
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${group})
  if(headers STREQUAL test)
    target_compile_options(${target} PRIVATE ${tessera_test_optimisation})
  endif()
  # Local types stay local, although the file is included by another.
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-subobject-linkage>)
  target_precompile_headers(${target} REUSE_FROM tessera_precompiled_${headers})
endfunction()

# tessera_library(NAME SOURCES... [PUBLIC libs...] [PRIVATE libs...]) -> target tessera_NAME, alias tessera::NAME
function(tessera_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(tessera_${name} STATIC ${arg_SOURCES})
  add_library(tessera::${name} ALIAS tessera_${name})
  target_include_directories(tessera_${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
  target_compile_options(tessera_${name} PRIVATE ${tessera_warnings})
  target_link_libraries(tessera_${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  tessera_compile_fast(tessera_${name} core)
endfunction()

# tessera_test(NAME SOURCES... LIBS...): one test program; every case in it is one CTest case. Those with a higher
# tessera_cost, about their seconds, start earlier when CTest has not seen how long they take: none is left for the end.
set(tessera_cost 0)
function(tessera_test name)
  if(NOT TESSERA_TESTS)
    return()
  endif()
  cmake_parse_arguments(arg "" "TIMEOUT;LOCK" "SOURCES;LIBS" ${ARGN})
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  math(EXPR arg_TIMEOUT "${arg_TIMEOUT} * ${tessera_slowness}")
  # Cases with a lock of one name run one after the other.
  set(lock)
  if(arg_LOCK)
    set(lock RESOURCE_LOCK ${arg_LOCK})
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_compile_options(${name} PRIVATE ${tessera_warnings})
  target_link_libraries(${name} PRIVATE ${arg_LIBS} GTest::gmock_main)
  tessera_compile_fast(${name} test)
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT ${arg_TIMEOUT} COST ${tessera_cost} ${lock})
endfunction()

# tessera_test_by_precision(NAME TIMEOUT s SOURCES files... LIBS libraries...): tests that run once a precision, with
# `--precision=f32` or f64, since a process loads one engine. The sources have a main() that takes it.
function(tessera_test_by_precision name)
  if(NOT TESSERA_TESTS)
    return()
  endif()
  cmake_parse_arguments(arg "" "TIMEOUT" "SOURCES;LIBS" ${ARGN})
  math(EXPR arg_TIMEOUT "${arg_TIMEOUT} * ${tessera_slowness}")
  add_executable(${name} ${arg_SOURCES})
  target_compile_options(${name} PRIVATE ${tessera_warnings})
  target_link_libraries(${name} PRIVATE ${arg_LIBS} GTest::gmock Threads::Threads)
  tessera_compile_fast(${name} test)
  foreach(precision f32 f64)
    gtest_discover_tests(${name}
      TEST_PREFIX ${precision}.
      EXTRA_ARGS --precision=${precision}
      DISCOVERY_MODE PRE_TEST
      PROPERTIES TIMEOUT ${arg_TIMEOUT})
  endforeach()
endfunction()

# tessera_npm_packages(FOLDER COMMENT): building packages.stamp installs the packages of FOLDER/package-lock.json into
# node_modules of the current binary directory.
function(tessera_npm_packages folder comment)
  find_program(TESSERA_NPM npm REQUIRED)
  set(files ${folder}/package.json ${folder}/package-lock.json ${folder}/.npmrc)
  add_custom_command(OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/packages.stamp
    COMMAND ${CMAKE_COMMAND} -E copy ${files} ${CMAKE_CURRENT_BINARY_DIR}
    COMMAND ${TESSERA_NPM} ci --ignore-scripts --no-audit --no-fund --loglevel=error
    COMMAND ${CMAKE_COMMAND} -E touch packages.stamp
    DEPENDS ${files}
    WORKING_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}
    COMMENT ${comment})
endfunction()
