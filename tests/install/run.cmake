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

# Runs a command that must end with an exit code, and one line of a form that matches.
function(expect_failure code form pattern)
  run(result output error ${ARGN})
  if(NOT result EQUAL code)
    message(FATAL_ERROR "${ARGN}\nended with ${result}, not ${code}\n${output}\n${error}")
  endif()
  if(NOT error MATCHES "${form}" OR NOT error MATCHES "${pattern}")
    message(FATAL_ERROR "${ARGN}\nexpected one line with ${pattern}, not\n${error}")
  endif()
endfunction()

# A mistake of the user.
function(expect_refusal pattern)
  expect_failure(2 "^vrpipe: error: [^\n]+ \\([^\n]+\\): [^\n]+; [^\n]+\n$" "${pattern}" ${ARGN})
endfunction()

# A plugin that fails.
function(expect_fault pattern)
  expect_failure(1 "^vrpipe: fault: [^\n]+\n$" "${pattern}" ${ARGN})
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
    -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER})
  expect_success("" ${CMAKE_COMMAND} --build ${WORK_DIR}/${project})
endforeach()

# As documented, without a build type: optimised all the same.
file(STRINGS ${WORK_DIR}/consumer/build.ninja optimised REGEX "FLAGS = .* -O2")
if(NOT optimised)
  message(FATAL_ERROR "plugins are not optimised")
endif()

set(vrpipe ${prefix}/bin/vrpipe)
set(plugin ${WORK_DIR}/consumer/same_splat_qru.so)
# Preprocessed once: it is run some sixty times.
expect_success("" ${vrpipe} run --scene builtin:object --size 160x120 --fovy 10 --fidelity functional
  --save-draw ${WORK_DIR}/draw.spl)
set(draw --scene ${WORK_DIR}/draw.spl)

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
# Its warps and pairs are counted by its slot, so that nothing is missing from its energy.
expect_success("\"missing\": *\\[ *\\]" ${vrpipe} run ${draw} --variant qm --plugin ${plugin} --unit qru=same-splat --energy --json -)
# On a platform that sets parameters which the unit does not have; the user may not.
expect_success("" ${vrpipe} run ${draw} --platform mobile --fidelity lt --plugin ${plugin} --unit qru=same-splat)
expect_refusal("bin_quads" ${vrpipe} run ${draw} --plugin ${plugin} --unit qru=same-splat --set qru.bin_quads=64)

# Its effect: listed, active where splats may be merged, left out where they are not; taken in, and left out, by force.
expect_success("effect qru.same_splat_pairs of same-splat, functional: quads of the two triangles"
  ${vrpipe} units --plugin ${plugin} --slot qru)
function(expect_effect pattern)
  expect_success("." ${vrpipe} run --variant qm --plugin ${plugin} --unit qru=same-splat --json - ${ARGN})
  string(REGEX MATCH "{[^{}]*\"name\": *\"qru.same_splat_pairs\"[^{}]*}" entry "${output}")
  if(NOT entry MATCHES "${pattern}")
    message(FATAL_ERROR "expected ${pattern} in\n${entry}")
  endif()
endfunction()
file(WRITE ${WORK_DIR}/late.json "{\"commands\": [{\"draw\": \"draw.spl\", \"state\": {\"late_tests\": true,
  \"stencil\": {}}}]}")
set(late --frame ${WORK_DIR}/late.json)
expect_effect("\"state\": *\"active\".*\"proof\": *null.*\"reason\": *\"draws of splats: 1\"" ${draw})
expect_effect("\"state\": *\"omitted\".*\"proof\": *\"static\".*\"reason\": *\"all draws are tested after shading\"" ${late})
expect_effect("\"state\": *\"active\".*\"reason\": *\"asked for: all draws are tested after shading\"" ${late} --effects all)
expect_refusal("effect qru.same_splat_pairs is called for" ${vrpipe} run ${draw} --variant qm --plugin ${plugin}
  --unit qru=same-splat --effects auto,-qru.same_splat_pairs)

# The unit that derives from a shipped one: its parameters, all counters, and the same result at every fidelity.
set(counting ${WORK_DIR}/consumer/counting_rop.so)
foreach(fidelity functional bound lt cycle)
  set(one ${draw} --variant het --fidelity ${fidelity} --set crop.cache_bytes=8192 --json -)
  expect_success("\"result_hash\": *\"([0-9a-f]+)\"" ${vrpipe} run ${one})
  string(REGEX MATCH "\"result_hash\": *\"[0-9a-f]+\"" hash "${output}")
  expect_success("${hash}" ${vrpipe} run ${one} --plugin ${counting} --unit crop=counting-rop)
  if(NOT output MATCHES "crop.quads_unchanged" OR NOT output MATCHES "crop.pixels_stuck")
    message(FATAL_ERROR "statistics are missing at ${fidelity} in\n${output}")
  endif()
endforeach()

# The platform: two GPCs are faster than one.
expect_success("twin cycle het\\+qm [0-9]+ cycles" ${WORK_DIR}/consumer/twin_gpu)
string(REGEX MATCH "agx-orin-ideal-memory cycle baseline ([0-9]+)" ignored "${output}")
set(one ${CMAKE_MATCH_1})
string(REGEX MATCH "twin cycle baseline ([0-9]+)" ignored "${output}")
set(two ${CMAKE_MATCH_1})
if(NOT two LESS one)
  message(FATAL_ERROR "two GPCs take ${two} cycles, one takes ${one}")
endif()

# The frame: both of its draws blend.
expect_success("near: [1-9][0-9]* quads blended\nfar: [1-9][0-9]* quads blended" ${WORK_DIR}/consumer/layers)

# And as a plugin that brings nothing else.
set(wide ${WORK_DIR}/consumer/wide_platform.so)
expect_success("agx-orin-ideal-memory with two GPCs" ${vrpipe} platforms --plugin ${wide})
expect_success("" ${vrpipe} run ${draw} --fidelity lt --plugin ${wide} --platform wide)
expect_success("\"tgc.bins\": *32" ${vrpipe} run ${draw} --fidelity lt --plugin ${wide} --variant qm-small --json -)
expect_success("qm-small" ${vrpipe} compare ${draw} --fidelity lt --plugin ${wide} --platform wide)
expect_refusal("did you mean qm-small" ${vrpipe} run ${draw} --plugin ${wide} --variant qm-smal)

# The slot: it counts at every fidelity what RASTER makes, and is listed with its parameter.
set(tally --plugin ${WORK_DIR}/consumer/tally_slot.so)
expect_success("tally.beats_per_cycle" ${vrpipe} units ${tally} --platform tallied)
foreach(fidelity functional bound lt cycle)
  expect_success("\"quads_rasterized\": *([0-9]+)" ${vrpipe} run ${draw} ${tally} --platform tallied --fidelity ${fidelity}
    --json -)
  string(REGEX MATCH "\"quads_rasterized\": *([0-9]+)" ignored "${output}")
  set(quads ${CMAKE_MATCH_1})
  string(REGEX REPLACE "[ \n]" "" compact "${output}")
  if(NOT compact MATCHES "\"name\":\"tally.quads\",\"unit\":\"quads\",\"value\":${quads}[,}]" AND
     NOT compact MATCHES "\"name\":\"tally.quads\"[^{}]*\"value\":${quads}[,}]")
    message(FATAL_ERROR "tally.quads is not ${quads} at ${fidelity} in\n${output}")
  endif()
endforeach()
# What it takes is known at every fidelity, the bound included.
set(one_beat run ${draw} ${tally} --platform tallied --set tally.beats_per_cycle=1 --set crop.bytes_per_cycle=256
  --set crop.sectors_per_cycle=8 --set prop.color_bytes_per_cycle=256)
expect_success("" ${vrpipe} ${one_beat} --json -)
string(REGEX MATCH "\"cycles\": *([0-9]+)" ignored "${output}")
set(cycles ${CMAKE_MATCH_1})
foreach(fidelity bound lt)
  expect_success("" ${vrpipe} ${one_beat} --fidelity ${fidelity} --json -)
  string(REGEX MATCH "\"cycles\": *([0-9]+)" ignored "${output}")
  set(other ${CMAKE_MATCH_1})
  math(EXPR off "1000 * (${other} - ${cycles}) / ${cycles}")
  if(off GREATER 10 OR off LESS -10 OR (fidelity STREQUAL bound AND other GREATER cycles))
    message(FATAL_ERROR "${fidelity} has ${other} cycles with a slot of one's own, cycle ${cycles}")
  endif()
  expect_success("bound by (gpc0\\.)?(tally|TALLY)" ${vrpipe} ${one_beat} --fidelity ${fidelity})
endforeach()
expect_success("gpc0.tally is in slot tally, which was not validated" ${vrpipe} ${one_beat} --fidelity lt)
expect_refusal("link.tally.quads" ${vrpipe} run ${draw} ${tally} --platform tallied --set link.tally.quadz.depth=4)
expect_success("" ${vrpipe} run ${draw} ${tally} --platform tallied --set link.tally.quads.depth=1)

# The render kernel: less waiting, and the same picture and counts.
expect_success("software \\(no-barriers\\)" ${vrpipe} frames ${draw} --fidelity lt --plugin ${WORK_DIR}/consumer/no_barriers.so
  --unit render=no-barriers)

# The testbenches.
expect_success("100 seeds" ${WORK_DIR}/consumer/same_splat_bench)
expect_success("changes nothing" ${WORK_DIR}/consumer/counting_rop_bench)

# Plugins that cannot be used.
set(bad ${WORK_DIR}/bad_plugins)
expect_refusal("no such file" ${vrpipe} run ${draw} --plugin ${bad}/missing.so)
expect_refusal("not a vrpipe plugin" ${vrpipe} run ${draw} --plugin ${bad}/foreign.so)
expect_refusal("not a vrpipe plugin" ${vrpipe} run ${draw} --plugin ${SOURCE_DIR}/run.cmake)
expect_refusal("0\\.0\\.1" ${vrpipe} run ${draw} --plugin ${bad}/other_version.so)
expect_refusal("vertex-issue" ${vrpipe} run ${draw} --plugin ${bad}/duplicate.so)
expect_refusal("registers no unit" ${vrpipe} run ${draw} --plugin ${bad}/empty.so)
expect_refusal("'mobile': there is one" ${vrpipe} run ${draw} --plugin ${bad}/duplicate_platform.so)
expect_refusal("platform 'a/b.n.x1B.31m': its name is not 1 to 64 letters" ${vrpipe} platforms --plugin ${bad}/bad_name.so)
expect_refusal("no slot 'tcs'.*did you mean tc" ${vrpipe} run ${draw} --plugin ${bad}/misspelt.so)
expect_refusal("slot zrop has a module" ${vrpipe} run ${draw} --plugin ${bad}/module.so)
expect_refusal("loaded already" ${vrpipe} run ${draw} --plugin ${plugin} --plugin ${plugin})
expect_success("decoy" ${vrpipe} platforms --plugin ${bad}/decoy.so)

# Plugins that fail.
expect_fault("throwing.so.*no licence" ${vrpipe} units --plugin ${bad}/throwing.so)
expect_fault("exiting.so, while it is loaded: calls exit" ${vrpipe} units --plugin ${bad}/exiting.so)
expect_fault("segfaulting.so, while it is loaded: ended by signal 11" ${vrpipe} units --plugin ${bad}/segfaulting.so)
foreach(fidelity functional bound lt cycle)
  foreach(command run compare)
    set(faulty ${vrpipe} ${command} ${draw} --fidelity ${fidelity} --plugin ${bad}/faulty.so --unit)
    expect_fault("tc=throws at cycle [0-9]+: insert throws: too full" ${faulty} tc=throws)
    expect_fault("tc=takes-too-much at cycle [0-9]+: insert: [0-9]+ quads taken of" ${faulty} tc=takes-too-much)
    expect_fault("variant [a-z+]+: tc=crashes, [a-z_]+: ended by signal 11 .*faulty.so" ${faulty} tc=crashes)
    expect_fault("variant [a-z+]+: tc=exits, [a-z_]+: calls exit" ${faulty} tc=exits)
  endforeach()
endforeach()
expect_fault("effect qru.leaves, decide: calls exit" ${vrpipe} run ${draw} --plugin ${bad}/deciding.so)
expect_fault("effect qru.leaves at cycle 0: decide throws: no idea" ${CMAKE_COMMAND} -E env DECIDING_THROWS=1 ${vrpipe} run ${draw}
  --plugin ${bad}/deciding.so)
# The library has said before which index it was.
expect_failure(1 "vrpipe: fault: [^\n]+\n$" "qru=overruns, examine: ended by signal 6" ${vrpipe} run ${draw} --plugin ${bad}/faulty.so
  --unit qru=overruns)
expect_fault("vpo=crashes-when-made, make_behaviour: ended by signal 8" ${vrpipe} run ${draw} --plugin ${bad}/faulty.so
  --unit vpo=crashes-when-made)
expect_refusal("pairing" ${vrpipe} run ${draw} --unit qru=paring)
