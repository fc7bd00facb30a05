#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/parameter.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/registry.h>

namespace vrpipe {

/// Parameters of the draw's state and the precision of fixed-function hardware, set as `state.NAME`.
struct StateParameters : ParameterSet {
  Real termination_threshold{*this,
                             "termination_threshold",
                             0.996,
                             0.0,
                             1.0,
                             "alpha",
                             source::paper_text,
                             "a pixel is terminated when its alpha passes this (0.996 in single precision)"};
  Choice termination_compare{*this,
                             "termination_compare",
                             {"ge", "gt"},
                             0,
                             "VR-Pipe, algorithm 1 (>=); its text says \"exceeds\"",
                             "how alpha passes the threshold"};
  Real pruning_threshold{*this,
                         "pruning_threshold",
                         1.0 / 255.0,
                         0.0,
                         1.0,
                         "alpha",
                         source::paper_text,
                         "fragments with a smaller alpha are not blended"};
  Choice exponential{*this, "exponential", {"exact", "ex2", "fp16", "table256", "table16"},
                     1,     source::open,  "the fragment shader's exponential"};
  Choice blend_rounding{*this, "blend_rounding", {"rne", "rtz", "measured"},
                        0,     source::open,     "of the blender into the target format"};
  Choice splat_extent{
      *this,
      "splat_extent",
      {"obb", "aabb", "three_sigma"},
      0,
      source::paper_text,
      "what is rasterised for a splat: its box at alpha 1/255, oriented or axis-aligned, or at 3 sigmas"};
  Integer subpixel_bits{*this, "subpixel_bits", 8, 4, 12, "bits", "D3D11.3: 8", "of vertex coordinates"};
  Real obb_padding{*this,        "obb_padding",
                   0.75,         0.0,
                   16.0,         "sub-pixel steps",
                   source::open, "added to half axes so that snapping loses no fragment above the pruning threshold"};
};

/// Parameters of the L2, set as `l2.NAME`.
struct L2Parameters : ParameterSet {
  Integer latency_cycles{
      *this, "latency_cycles", 146, 1, 100000, "cycles", "Accel-Sim, SM87_ORIN: L2 latency", "from request to data"};
  Integer bytes_per_cycle{*this, "bytes_per_cycle", 128,          32,
                          4096,  "bytes",           source::open, "moved for each GPC: four sectors"};
};

/// A run's choices made final: an implementation and parameters for every slot.
class Configuration {
 public:
  /// Throws UserError for an unknown unit, parameter or value.
  Configuration(const RunRequest& request, const Draw& draw);

  /// A unit of a slot, of GPC `gpc`. `state_of(gpc)` outlives it.
  std::unique_ptr<Behaviour> make(const std::string& slot, unsigned gpc) const;
  template <class SlotBehaviour>
  std::unique_ptr<SlotBehaviour> make_as(const std::string& slot, unsigned gpc) const;

  const RunRequest& request() const { return request_; }
  const Platform& platform() const { return *request_.platform; }
  const RenderState& state_of(unsigned gpc) const { return states_[gpc]; }
  /// What is in a slot, in this variant.
  const Implementation& implementation(const std::string& slot) const { return *slots_.at(slot).chosen; }
  const L2Parameters& l2() const { return l2_; }
  std::vector<std::pair<std::string, std::string>> parameters() const;

 private:
  struct Slot {
    const Implementation* chosen = nullptr;  ///< in this variant
    const Implementation* real = nullptr;    ///< when not pass-through
    std::unique_ptr<ParameterSet> chosen_parameters;
    std::unique_ptr<ParameterSet> real_parameters;
  };
  void apply(const Setting& setting);
  bool concerns_chosen_unit(const Setting& setting) const;

  RunRequest request_;
  std::map<std::string, Slot> slots_;
  StateParameters state_parameters_;
  L2Parameters l2_;
  std::vector<RenderState> states_;
};

/// The default implementation of a slot; the pass-through one where the variant does without the unit.
const Implementation& default_implementation(const std::string& slot, const Variant& variant);

}  // namespace vrpipe

#include <vrpipe/unit.h>

namespace vrpipe {

template <class SlotBehaviour>
std::unique_ptr<SlotBehaviour> Configuration::make_as(const std::string& slot, unsigned gpc) const {
  return behaviour_as<SlotBehaviour>(make(slot, gpc));
}

}  // namespace vrpipe
