#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/frame_facts.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

/// Parameters of a platform as a whole, set as `platform.NAME`.
struct PlatformParameters : ParameterSet {
  explicit PlatformParameters(const Platform& platform);
  Integer gpcs;
};

/// Parameters of a draw's state, unless the draw says otherwise, and of the hardware's precision, set as `state.NAME`.
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
  Choice shading{*this,
                 "shading",
                 {"fp32", "fp16"},
                 0,
                 "the published shader's",
                 "of alpha and colour in the fragment shader, from the sample's distance of the centre on: fp16 rounds "
                 "each operation"};
  Choice merging{
      *this, "merging",    {"fp32", "fp16"},
      0,     source::open, "of two fragments into one (QM): in fp16 1 - alpha is rounded, and each multiply-add once"};
  Choice attributes{*this,
                    "attributes",
                    {"fp32", "fp16", "quantized"},
                    0,
                    "the published renderer's",
                    "of a splat, beside its centre: 2x2 matrix, opacity and colour; quantized: the matrix in fp16, "
                    "opacity and colour as UNORM8. Of 40 bytes 24 are loaded, or 20"};
  Choice export_format{*this, "export_format", {"fp32", "fp16"},
                       0,     source::open,    "of the colours that the fragment shader sends to be blended"};
  Real alpha_max{*this,
                 "alpha_max",
                 0.99,
                 0.0,
                 1.0,
                 "alpha",
                 "INRIA's renderer, forward.cu",
                 "that the fragment shader clamps alpha to"};
  Choice depth_format{*this,
                      "depth_format",
                      {"d16", "d24", "d32f"},
                      1,
                      "the format that graphics APIs demand with a stencil",
                      "of the depth target, beside 8 bits of stencil"};
  Choice splat_extent{*this,
                      "splat_extent",
                      {"obb", "aabb", "three_sigma", "fill_rectangle"},
                      0,
                      source::paper_text,
                      "what is rasterised for a splat: its box at alpha 1/255, oriented or axis-aligned, or at 3 "
                      "sigmas, as two triangles; "
                      "or the axis-aligned one as one primitive (NV_fill_rectangle)"};
  Integer subpixel_bits{*this, "subpixel_bits", 8, 4, 12, "bits", "D3D11.3: 8", "of vertex coordinates"};
  Real obb_padding{*this,        "obb_padding",
                   0.75,         0.0,
                   16.0,         "sub-pixel steps",
                   source::open, "added to half axes so that snapping loses no fragment above the pruning threshold"};

  /// What each draw may set for itself; the others are the hardware's precision.
  std::vector<Parameter*> of_draws() {
    return {&termination_threshold, &termination_compare, &pruning_threshold, &splat_extent, &obb_padding};
  }
};

/// A run's choices made final: the platform's netlist, an implementation and parameters for every unit and link of it.
class Configuration {
 public:
  /// Throws UserError for an unknown unit, link, parameter or value, and SimulationFault for a platform whose wiring
  /// throws something else.
  Configuration(const RunRequest& request, const Frame& frame);
  /// Of a part of the frame of another one, in the same variant: it simulates the effects that the whole frame calls for.
  Configuration(const RunRequest& request, const Frame& part, const Configuration& whole);

  /// The functional model of an instance. This configuration outlives it.
  std::unique_ptr<Behaviour> make(const Instance& instance) const;
  template <class SlotBehaviour>
  std::unique_ptr<SlotBehaviour> make_as(const Instance& instance) const {
    return behaviour_as<SlotBehaviour>(make(instance));
  }

  const RunRequest& request() const { return request_; }
  /// Whether it is simulated cycle by cycle, by the run's fidelity or by RunRequest::units_at_cycle.
  bool is_at_cycle(const Instance& instance) const;
  const Platform& platform() const { return *request_.platform; }
  /// What is elaborated: the platform's, without what all its effects left out.
  const Netlist& netlist() const { return elaborated_; }
  const RenderContext& context_of(unsigned gpc) const { return contexts_[gpc]; }
  /// What is drawn, in this variant: without the units for it no draw terminates early.
  const Frame& frame() const { return *contexts_.front().frame; }
  /// What is in an instance, in this variant.
  const Implementation& implementation(const Instance& instance) const { return *units_.at(instance.path).chosen; }
  /// PATH.PARAMETER and value: the slot's where all its instances agree, otherwise also those of the instances that
  /// differ from the first.
  std::vector<std::pair<std::string, std::string>> parameters() const;
  /// What was decided of each effect, and what became of those that were watched.
  std::vector<EffectReport> effects() const;
  /// Slot and name of the implementation in it, in the order of the pipeline; an instance's, by its path, where it
  /// differs from the slot's first.
  std::vector<std::pair<std::string, std::string>> implementations() const;

 private:
  struct UnitChoices {
    const Implementation* chosen = nullptr;  ///< in this variant
    const Implementation* real = nullptr;    ///< when not pass-through
    std::unique_ptr<ParameterSet> chosen_parameters;
    std::unique_ptr<ParameterSet> real_parameters;
  };
  Configuration(const RunRequest& request, const Frame& frame, std::shared_ptr<const FrameFacts> facts);
  void wire();
  void decide_effects();
  void check_left_out() const;
  void leave_out_parts(OmittedEffects& omitted, bool memories);
  void choose_implementations();
  void check_units_at_cycle() const;
  void apply(const Setting& setting);
  void set_link(const Setting& setting);
  bool set_absent(const Setting& setting);
  std::shared_ptr<const TileOwners> owners_of_tiles(const RenderContext& context) const;
  bool all_know_coverage(const std::string& slot, unsigned gpc) const;
  bool concerns_chosen_unit(const Setting& setting) const;
  std::vector<const Instance*> instances_named(const std::string& name) const;
  std::vector<const Instance*> instances_of(const std::string& slot) const;

  RunRequest request_;
  Netlist netlist_;  ///< the platform's
  Netlist elaborated_;
  std::map<std::string, UnitChoices> units_;             ///< by path
  std::map<std::string, const Implementation*> absent_;  ///< what would be in slots that the platform does without
  StateParameters state_parameters_;
  std::vector<RenderContext> contexts_;  ///< by GPC
  std::shared_ptr<const FrameFacts> facts_;
  std::vector<EffectReport> effects_;  ///< before the run
};

/// The default implementation of a slot; what stands in where the variant does without the unit.
const Implementation& default_implementation(const Slot& slot, const Variant& variant);

}  // namespace vrpipe
