# What every target of the project is built with.
set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib)
set(CMAKE_INSTALL_RPATH $ORIGIN/../${CMAKE_INSTALL_LIBDIR})

# The compilers of scripts/check give no warnings; others may have new ones.
set(checked_compiler OFF)
if(PROJECT_IS_TOP_LEVEL AND "${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}" MATCHES "^(GNU 12|Clang 14)\\.")
  set(checked_compiler ON)
endif()
option(VRPIPE_WARNINGS_AS_ERRORS "stop at warnings" ${checked_compiler})
# Most of a source's time goes into its headers, so that a batch of them takes little longer than one.
option(VRPIPE_UNITY "compile sources in batches; OFF compiles one alone, for who works on it" ON)
set(CMAKE_UNITY_BUILD ${VRPIPE_UNITY})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)

set(VRPIPE_SANITIZE "" CACHE STRING "sanitizers, as for -fsanitize=")

find_package(PkgConfig REQUIRED)
pkg_check_modules(systemc REQUIRED IMPORTED_TARGET systemc)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(glm REQUIRED)
find_package(Threads REQUIRED)

# What the headers need, also outside the tree: results are the same on every compiler and processor. Debian's SystemC
# is built for C++17 alone.
add_library(vrpipe_options INTERFACE)
target_compile_features(vrpipe_options INTERFACE cxx_std_17)
target_compile_options(vrpipe_options INTERFACE -ffp-contract=off)
target_compile_definitions(vrpipe_options INTERFACE VRPIPE_VERSION="${PROJECT_VERSION}" GLM_FORCE_SIZE_T_LENGTH)
target_link_libraries(vrpipe_options INTERFACE PkgConfig::systemc fmt::fmt glm::glm)

include(vrpipe_plugin)
vrpipe_plugin_tag(VRPIPE_PLUGIN_TAG ${PROJECT_VERSION})

# For the project's own code only.
# Results are the same on every processor; the wider instructions only take less time.
include(CheckCXXSourceRuns)
set(CMAKE_REQUIRED_FLAGS -march=x86-64-v3)
check_cxx_source_runs("int main() { return __builtin_cpu_supports(\"avx2\") && __builtin_cpu_supports(\"bmi2\") ? 0 : 1; }"
  VRPIPE_RUNS_X86_64_V3)
unset(CMAKE_REQUIRED_FLAGS)
option(VRPIPE_X86_64_V3 "instructions of x86-64-v3 (2013 on)" ${VRPIPE_RUNS_X86_64_V3})
if(VRPIPE_X86_64_V3)
  add_compile_options(-march=x86-64-v3)
endif()
# Nobody replaces a function of the library's by one of the same name.
add_compile_options(-fno-semantic-interposition -fno-plt -fvisibility-inlines-hidden)
add_link_options(-Wl,-Bsymbolic-functions)
# By which cached scenes are known: g++ asks for it by default, clang++ does not.
add_link_options(-Wl,--build-id=sha1)
# Vectors wider than the processor's registers cross no library's boundary.
add_compile_options(-Wno-psabi)
add_compile_options(-Wall -Wextra -Wshadow -Wconversion)
if(VRPIPE_WARNINGS_AS_ERRORS)
  add_compile_options(-Werror)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  # A tenth of its time is collecting what it has no use for, as soon as it has 128 MiB.
  add_compile_options(--param=ggc-min-heapsize=524288)
endif()
if(VRPIPE_SANITIZE)
  add_compile_options(-fsanitize=${VRPIPE_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  if(VRPIPE_SANITIZE MATCHES address)
    # Checks of the dynamic type at every call take a third of compiling, those of every pointer a fifth, and AddressSanitizer
    # sees what is read through most of them. Preset ubsan has them.
    add_compile_options(-fno-sanitize=vptr,null,alignment,object-size)
  endif()
  add_link_options(-fsanitize=${VRPIPE_SANITIZE})
endif()
