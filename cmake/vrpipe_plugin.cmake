# Plugins: shared objects whose units register themselves when `vrpipe --plugin FILE.so` loads them.

# What a plugin and the vrpipe that loads it must agree on: the version, since headers are part of the interface, and
# the C++ ABI, which g++ and clang++ share.
function(vrpipe_plugin_tag variable version)
  if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
    set(abi itanium)
  else()
    set(abi ${CMAKE_CXX_COMPILER_ID})
  endif()
  set(${variable} "vrpipe-plugin/${version}/${abi}-abi" PARENT_SCOPE)
endfunction()

# vrpipe_add_plugin(name sources...): builds name.so, to be loaded, or linked by a testbench that names its classes. One of
# the sources contains VRPIPE_PLUGIN.
function(vrpipe_add_plugin name)
  add_library(${name} SHARED ${ARGN})
  set_target_properties(${name} PROPERTIES PREFIX "")
  # A unit is asked millions of times in a frame.
  if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
    target_compile_options(${name} PRIVATE -O2)
  endif()
  # An index beyond an array of what it is given ends in its own call, not later and elsewhere.
  target_compile_definitions(${name} PRIVATE VRPIPE_PLUGIN_TAG="${VRPIPE_PLUGIN_TAG}" _GLIBCXX_ASSERTIONS)
  target_link_libraries(${name} PRIVATE vrpipe::vrpipe)
  # Whoever links a plugin wants its units registered, even if it names none of its classes.
  target_link_options(${name} INTERFACE LINKER:--no-as-needed)
endfunction()
