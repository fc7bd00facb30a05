# Installs BUILD_DIR to a prefix of its own, builds the examples that come with it and bad_plugins/ against it, and runs them.

function(run result_variable output_variable error_variable)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE error)
  set(${result_variable} ${result} PARENT_SCOPE)
  set(${output_variable} "${output}" PARENT_SCOPE)
  set(${error_variable} "${error}" PARENT_SCOPE)
endfunction()

# Runs a command that must succeed, and matches its output.
function(expect_success pattern)
  run(result output error ${ARGN})
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGN}\nended with ${result}\n${output}\n${error}")
  endif()
  if(NOT output MATCHES "${pattern}")
    message(FATAL_ERROR "${ARGN}\nexpected ${pattern} in\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

# Runs a command that must be refused: exit code 2, and one line that matches.
function(expect_refusal pattern)
  run(result output error ${ARGN})
  if(NOT result EQUAL 2)
    message(FATAL_ERROR "${ARGN}\nended with ${result}, not 2\n${output}\n${error}")
  endif()
  if(NOT error MATCHES "^vrpipe: error: [^\n]+ \\([^\n]+\\): [^\n]+; [^\n]+\n$" OR NOT error MATCHES "${pattern}")
    message(FATAL_ERROR "${ARGN}\nexpected one line with ${pattern}, not\n${error}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
set(prefix ${WORK_DIR}/prefix)
expect_success("vrpipe-config.cmake" ${CMAKE_COMMAND} --install ${BUILD_DIR} --config ${CONFIG} --prefix ${prefix})

# The documents, with links that hold, and the examples.
expect_success("" ${SOURCE_DIR}/../docs/check_links ${prefix}/share/doc/vrpipe)
foreach(document docs/results.md docs/images/builtin.png modules/crop/README.md LICENSE)
  if(NOT EXISTS ${prefix}/share/doc/vrpipe/${document})
    message(FATAL_ERROR "${document} is not installed")
  endif()
endforeach()

set(consumer ${prefix}/share/vrpipe/examples)
set(bad_plugins ${SOURCE_DIR}/bad_plugins)
foreach(project consumer bad_plugins)
  expect_success("" ${CMAKE_COMMAND} -G Ninja -S ${${project}} -B ${WORK_DIR}/${project}
    -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
    -DCMAKE_BUILD_TYPE=Release)
  expect_success("" ${CMAKE_COMMAND} --build ${WORK_DIR}/${project})
endforeach()

set(vrpipe ${prefix}/bin/vrpipe)
set(plugin ${WORK_DIR}/consumer/same_splat_qru.so)
set(draw --scene builtin:object --size 160x120)

# The unit: it pairs some quads, and fewer than the paper's; the picture and the counts are checked by the run itself.
function(quads_merged variable)
  expect_success("\"quads_merged\": *([0-9]+)" ${vrpipe} run ${draw} --variant qm --json - ${ARGN})
  string(REGEX MATCH "\"quads_merged\": *([0-9]+)" ignored "${output}")
  set(${variable} ${CMAKE_MATCH_1} PARENT_SCOPE)
endfunction()
quads_merged(same_splat --plugin ${plugin} --unit qru=same-splat)
quads_merged(pairing)
if(NOT (same_splat GREATER 0 AND same_splat LESS pairing))
  message(FATAL_ERROR "quads merged: ${same_splat} with same-splat, ${pairing} with pairing")
endif()
expect_success("" ${vrpipe} compare ${draw} --termination strict --plugin ${plugin} --unit qru=same-splat
  --set qru.quads_per_cycle=4)
expect_refusal("same-splat" ${vrpipe} run ${draw} --plugin ${plugin} --unit qru=same-spalt)

# The platform: two GPCs are faster than one.
expect_success("twin het\\+qm [0-9]+ cycles" ${WORK_DIR}/consumer/twin_gpu)
string(REGEX MATCH "agx-orin baseline ([0-9]+)" ignored "${output}")
set(one ${CMAKE_MATCH_1})
string(REGEX MATCH "twin baseline ([0-9]+)" ignored "${output}")
set(two ${CMAKE_MATCH_1})
if(NOT two LESS one)
  message(FATAL_ERROR "two GPCs take ${two} cycles, one takes ${one}")
endif()

# The testbench.
expect_success("100 seeds" ${WORK_DIR}/consumer/same_splat_bench ${plugin})

# Plugins that cannot be used.
set(bad ${WORK_DIR}/bad_plugins)
expect_refusal("no such file" ${vrpipe} run ${draw} --plugin ${bad}/missing.so)
expect_refusal("not a vrpipe plugin" ${vrpipe} run ${draw} --plugin ${bad}/foreign.so)
expect_refusal("not a vrpipe plugin" ${vrpipe} run ${draw} --plugin ${SOURCE_DIR}/run.cmake)
expect_refusal("0\\.0\\.1" ${vrpipe} run ${draw} --plugin ${bad}/other_version.so)
expect_refusal("vertex-issue" ${vrpipe} run ${draw} --plugin ${bad}/duplicate.so)
expect_refusal("registers no unit" ${vrpipe} run ${draw} --plugin ${bad}/empty.so)
expect_refusal("pairing" ${vrpipe} run ${draw} --unit qru=paring)
