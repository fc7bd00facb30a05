#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

/// Of an SM array: one of your own derives its parameters from these.
struct SmParameters : ParameterSet {
  Integer cores{*this, "cores", 16, 1, 1024, "cores", source::paper_table, "SIMT cores of the GPC"};
  Integer schedulers_per_core{
      *this, "schedulers_per_core", 4, 1, 64, "schedulers", source::paper_table, "warp schedulers"};
  Integer lanes_per_scheduler{*this,
                              "lanes_per_scheduler",
                              16,
                              1,
                              32,
                              "lanes",
                              source::paper_table,
                              "a warp instruction issues for 32 / lanes cycles"};
  Integer warps_per_core{
      *this, "warps_per_core", 48, 1, 256, "warps", "Accel-Sim, SM87_ORIN: 48 warps", "fragment warps in flight"};
  Integer vertex_warps{
      *this,        "vertex_warps",
      32,           1,
      1024,         "warps",
      source::open, "vertex warps in flight in the array, kept apart so that the pipeline cannot lock"};
  Integer warps_to_one_core{*this,
                            "warps_to_one_core",
                            8,
                            1,
                            256,
                            "warps",
                            "measured on a GH100 graphics GPC: 64 quads to one SM, SMs in turn",
                            "consecutive warps of a screen tile that go to the same core"};
  Real warp_launch_cycles{*this,
                          "warp_launch_cycles",
                          0,
                          0,
                          1000,
                          "cycles",
                          "left open by the paper; measured on a GH100 graphics GPC with 2 TPCs: 2.5",
                          "of handing a warp to a core; 0: a warp a cycle"};
  Real visit_launch_cycles{
      *this,
      "visit_launch_cycles",
      0,
      0,
      1000,
      "cycles",
      "left open by the paper; measured on a GH100 graphics GPC with 2 TPCs: 4",
      "beside that, of handing over a primitive's quads in a screen tile; the longer of the two counts"};
  Real discard_launch_cycles{*this,
                             "discard_launch_cycles",
                             0,
                             0,
                             1000,
                             "cycles",
                             "left open by the paper; measured on a GH100 graphics GPC with 2 TPCs: 1.7",
                             "on top of that, of a program with attributes that discards"};
  Real discard_warp_cycles{*this,
                           "discard_warp_cycles",
                           0,
                           0,
                           1000,
                           "cycles",
                           "left open by the paper; measured on a GH100 graphics GPC with 2 TPCs: 1.03",
                           "on top of warp_launch_cycles, of a program with attributes that discards"};
  Integer vertex_instructions{*this,        "vertex_instructions",
                              20,           1,
                              1000,         "instructions",
                              source::open, "of the vertex shader: centre plus two semi-axes"};
  Integer fragment_instructions{*this,        "fragment_instructions",
                                24,           1,
                                1000,         "instructions",
                                source::open, "of the fragment shader: attributes, dot product, ex2, prune, export"};
  Integer mesh_instructions{*this,
                            "mesh_instructions",
                            29,
                            1,
                            1000,
                            "instructions",
                            source::open,
                            "of the fragment shader of meshes: 4 to fetch, 1/w and its reciprocal, 6 "
                            "attributes, 3 and a square root for the normal, 6 for the light, 3 for the "
                            "colour, 4 to export"};
  Integer alpha_threshold_instructions{
      *this,
      "alpha_threshold_instructions",
      5,
      1,
      1000,
      "instructions",
      source::open,
      "of the shader that discards what has not terminated: 2 for the pixel, load, compare, discard"};
  Integer merge_instructions{
      *this,        "merge_instructions",
      13,           1,
      1000,         "instructions",
      source::open, "issue slots of a merge: 4 shuffles of two slots, 1 subtraction, 4 multiply-adds"};
  Integer attribute_latency_cycles{*this,
                                   "attribute_latency_cycles",
                                   146,
                                   0,
                                   10000,
                                   "cycles",
                                   "Accel-Sim, SM87_ORIN: L2 latency",
                                   "of fetching vertices, or attributes, where the memory port is not connected"};
  Integer attribute_bytes{*this,
                          "attribute_bytes",
                          40,
                          4,
                          attribute_bytes_per_splat / 2,
                          "bytes",
                          "the fragment shader's 10 values: centre, 2x2 matrix, opacity, colour",
                          "of its attributes that are read for a primitive, where the memory port is connected"};
  Integer attribute_buffer_bytes{*this,
                                 "attribute_buffer_bytes",
                                 1 << 20,
                                 1 << 16,
                                 1 << 30,
                                 "bytes",
                                 source::open,
                                 "of the circular buffer that attributes are written to; what is overwritten is "
                                 "taken to be needed no more"};
  Integer attribute_writes{*this,        "attribute_writes",
                           640,          1,
                           65536,        "accesses",
                           source::open, "of attributes in flight; enough for what draw issues at the latency of L2"};
  Integer memory_bytes_per_cycle{*this,
                                 "memory_bytes_per_cycle",
                                 32,
                                 32,
                                 1024,
                                 "bytes",
                                 "Accel-Sim, SM87_ORIN: flits of 40 bytes carry 32, for each cluster",
                                 "that the memory port has in each direction for each core"};
  Integer l1_bytes{*this,
                   "l1_bytes",
                   49152,
                   0,
                   1 << 20,
                   "bytes",
                   source::paper_table,
                   "L1 of a core, through which attributes are read; lines of 128 bytes, sectors of 32; 0: none, they "
                   "are read from what the memory port is bound to"};
  Integer l1_ways{*this, "l1_ways", 0, 0, 1 << 13, "ways", source::open, "of a set of an L1; 0: fully associative"};
  Integer l1_mshrs{*this,
                   "l1_mshrs",
                   384,
                   1,
                   65536,
                   "sectors",
                   "Accel-Sim, SM87_ORIN: 384 MSHRs of a first-level cache",
                   "that an L1, or a core without one, has asked for and not got"};
  Integer l1_latency_cycles{*this,
                            "l1_latency_cycles",
                            38,
                            0,
                            10000,
                            "cycles",
                            "Accel-Sim, SM87_ORIN: L1 latency",
                            "from the launch until what the L1 holds is there; what it lacks takes as long as memory "
                            "says, and not less"};
  Integer fragment_latency_cycles{*this,
                                  "fragment_latency_cycles",
                                  75,
                                  0,
                                  10000,
                                  "cycles",
                                  "Accel-Sim, SM87_ORIN: 4 cycles an instruction, 23 a special function",
                                  "of the dependent instructions beyond their issue slots"};
  Integer merge_latency_cycles{*this,        "merge_latency_cycles",
                               30,           0,
                               10000,        "cycles",
                               source::open, "of shuffle and partial blend beyond their issue slots"};
};

}  // namespace vrpipe
