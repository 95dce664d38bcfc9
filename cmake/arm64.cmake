# Cross-compiles for arm64 by Debian's GCC, with the libraries of a Debian root for arm64, and runs programs by qemu. The
# variable TESSERA_ARM64_ROOT of the environment names that root, which tests/other_machines.sh makes.
set(root $ENV{TESSERA_ARM64_ROOT})
if(NOT root)
  set(root /opt/tessera-arm64)
endif()
if(NOT EXISTS ${root}/usr/lib/aarch64-linux-gnu)
  message(FATAL_ERROR "${root} is not a Debian root for arm64: TESSERA_ARM64_ROOT must name one (docs/platforms.md)")
endif()

set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_SYSROOT ${root})
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static -L ${root})

# Tools from this machine, all else from the root.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${root})
set(ENV{PKG_CONFIG_LIBDIR} ${root}/usr/lib/aarch64-linux-gnu/pkgconfig:${root}/usr/share/pkgconfig)
