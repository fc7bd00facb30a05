#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/memory/cache_organization.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// A shader as its scheduler sees it: instructions to issue, then cycles until the next can issue.
struct ShaderSegment {
  std::uint32_t instructions;
  std::uint32_t stall_cycles;
};

/// Of a program.
inline std::uint64_t instructions_in(const std::vector<ShaderSegment>& program) {
  std::uint64_t sum = 0;
  for (const ShaderSegment& segment : program) sum += segment.instructions;
  return sum;
}

/// How an SM array fetches vertices and attributes where its memory port is connected, by its parameters.
struct AttributeFetch {
  std::uint32_t attribute_bytes = 0;    ///< of a primitive, that the fragment shader reads
  std::uint32_t buffer_bytes = 0;       ///< of memory, in which attributes go round
  std::uint32_t attribute_writes = 0;   ///< of the array in flight: what comes behind waits
  std::uint32_t core_bytes = 0;         ///< a cycle, of a core's share of the array's memory port
  std::uint32_t l1_latency_cycles = 0;  ///< until what a core's L1 holds is there
  std::uint32_t l1_mshrs = 0;           ///< sectors that a core may have asked for
  CacheOrganization l1;                 ///< lines of 128 bytes, sectors of 32; of 0 bytes: none
  bool has_l1() const { return l1.bytes != 0; }
};

/// What handing fragment warps to cores takes beyond a cycle each, in thousandths of a cycle. Warps and visits go side by side.
struct HandOverPrice {
  std::uint32_t warp_thousandths = 0;
  std::uint32_t visit_thousandths = 0;         ///< of a primitive's quads in a screen tile, one after the other
  std::uint32_t discard_thousandths = 0;       ///< on top of a visit, of a program with attributes that discards
  std::uint32_t discard_warp_thousandths = 0;  ///< on top of a warp, of such a program
  bool is_on() const {
    return (warp_thousandths | visit_thousandths | discard_thousandths | discard_warp_thousandths) != 0;
  }
};

struct SmParameters;

/// What an SM array's work takes, by its parameters (modules/sm/sm_parameters.h): all that its models of `cycle`, `lt` and
/// `bound` ask for, and kernels that run on it in place of the pipeline.
struct SmTime {
  /// Throws UserError for an array that cannot be.
  SmTime(const SmParameters& parameters, const DevicePrecision& precision);

  std::uint32_t cores;
  std::uint32_t schedulers_per_core;
  std::uint32_t lanes_per_scheduler;  ///< a divisor of 32
  std::uint32_t warps_per_core;
  std::uint32_t vertex_warps;       ///< of the array that may be in flight
  std::uint32_t warps_to_one_core;  ///< consecutive warps of a tile that go to one core
  /// The first stall of the vertex and of the fragment program is that of fetching what it reads; where the memory port
  /// is connected the memory says how long that takes.
  std::vector<ShaderSegment> vertex;
  std::vector<ShaderSegment> fragment;
  std::vector<ShaderSegment> mesh;             ///< the fragment program of meshes
  std::vector<ShaderSegment> alpha_threshold;  ///< of FragmentShader::alpha_threshold
  std::vector<ShaderSegment> merge;            ///< appended for a warp with pairs
  AttributeFetch fetch;
  HandOverPrice hand_over;

  /// The fragment program of draws with a shader.
  const std::vector<ShaderSegment>& fragment_program(FragmentShader shader) const;
  /// Fragment warps in flight in the array: no more than slots have numbers.
  std::uint32_t fragment_slots() const { return cores * warps_per_core; }
  /// Cycles for which an instruction of a warp has its scheduler.
  std::uint32_t cycles_per_instruction() const { return 32 / lanes_per_scheduler; }
  std::uint32_t schedulers() const { return cores * schedulers_per_core; }
  /// Warp instructions that the array issues at most.
  double instructions_per_cycle() const { return double{1} * schedulers() / cycles_per_instruction(); }
  /// Of the array's memory port.
  std::uint32_t memory_bytes_per_cycle() const { return cores * fetch.core_bytes; }
  /// As in SmWork.
  std::vector<WorkKind> kinds() const;
};

/// Slot `sm`: vertex and fragment shading, alpha pruning, quad merging.
class SmBehaviour : public Behaviour {
 public:
  /// Before the first warp: what shaders read that read colour (reads_color). One that overrides it calls it.
  virtual void attach(const ColorSurface& surface) { surface_ = &surface; }
  /// Shades, prunes and merges: fills `out` but for its slot and its pool, which are the module's.
  virtual void shade(const Warp& warp, ShadedWarp& out) = 0;
  virtual void shade_vertices(const VertexWarp& warp) = 0;
  /// What its work takes: the parameters of its timing models.
  virtual const SmTime& time() const = 0;

  void use_surfaces(Framebuffer& framebuffer) override { attach(framebuffer.color); }
  void add_to(Counts& counts, const CountOf& of) const override {
    counts.quads_shaded += of(quads_shaded);
    counts.fragments_shaded += of(fragments_shaded);
    counts.quads_pruned += of(quads_pruned);
    counts.fragments_pruned += of(fragments_pruned);
    counts.quads_merged += of(quads_merged);
    counts.fragments_merged += of(fragments_merged);
    counts.warps += of(fragment_warps);
  }

  DrawCounter quads_shaded{*this, "quads_shaded", "quads", "launched in fragment warps"};
  DrawCounter fragments_shaded{*this, "fragments_shaded", "fragments", "live samples launched"};
  DrawCounter quads_pruned{*this, "quads_pruned", "quads", "that lost their last fragment to alpha pruning"};
  DrawCounter fragments_pruned{*this, "fragments_pruned", "fragments", "with alpha below the threshold"};
  /// Of a pair, its back quad's draw; what is left is its front quad's.
  DrawCounter quads_merged{*this, "quads_merged", "quads", "taken away by merging, one a pair with two live quads"};
  DrawCounter fragments_merged{*this, "fragments_merged", "fragments", "taken away by merging, where both are live"};
  Counter fragments_of_back_quads{*this, "fragments_of_back_quads", "fragments",
                                  "live in the back quads of merged pairs, whether or not the front's are"};
  Counter fragment_warps{*this, "fragment_warps", "warps", "of fragments"};
  Counter vertex_warps{*this, "vertex_warps", "warps", "of vertices"};

  /// For the modules: `shade_vertices`, and counts the warp for any unit.
  void shade_and_count(const VertexWarp& warp) {
    ++dynamic_cast<SmBehaviour&>(unit()).vertex_warps;
    shade_vertices(warp);
  }

 protected:
  const ColorSurface* surface_ = nullptr;
};

/// The slot's kinds of work.
struct SmWork {
  /// Warp instructions; and handing warps to cores, in thousandths of a cycle.
  enum : unsigned { vertex, fragment, merge, launches, visits };
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_sm(const std::string& name, const RenderContext& context,
                                    std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
