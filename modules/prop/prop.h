#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/component/parameter.h>
#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/pipeline_stages.h>
#include <vrpipe/kernel/rate.h>
#include <vrpipe/pipeline/slots/prop.h>

namespace vrpipe {

/// Of a PROP: one of your own derives its parameters from these.
struct PropParameters : ParameterSet {
  Integer quads_per_cycle{*this,
                          "quads_per_cycle",
                          16,
                          1,
                          16,
                          "quads",
                          source::open,
                          "from TC to ZROP and on to QRU; must exceed what the shaders and CROP can take by the "
                          "share that termination kills"};
  Integer color_bytes_per_cycle{*this,
                                "color_bytes_per_cycle",
                                64,
                                16,
                                256,
                                "bytes",
                                source::paper_text,
                                "of target format from PROP to CROP: 2 quads of RGBA16F, 4 of RGBA8; what is no whole "
                                "number of quads is a fraction of one"};
  Integer latency_cycles{*this, "latency_cycles", 4, 1, 1000, "cycles", source::open, "of each passage"};
  Choice order{
      *this, "order",          {"draw", "tile"},
      1,     source::measured, "shaded warps leave in launch order of the whole frame, or of their screen tile"};
};

/// What PROP's work takes, by its parameters: all that its models of `cycle`, `lt` and `bound` ask for.
struct PropTime {
  enum class Order : std::uint8_t { draw, tile };
  PropTime(const PropParameters& parameters, ColorFormat format)
      : quads_per_cycle(parameters.quads_per_cycle),
        color_rate(Rate::of_bytes(parameters.color_bytes_per_cycle, 4 * bytes_per_pixel(format))),
        latency_cycles(parameters.latency_cycles),
        order(static_cast<Order>(static_cast<unsigned>(parameters.order))) {}

  const std::uint32_t quads_per_cycle;  ///< TC to ZROP to QRU
  const Rate color_rate;                ///< of quads to CROP, of this draw's format
  const std::uint32_t latency_cycles;
  const Order order;

  /// Of bins and survivors, beats of quads.
  PipelineStages of_bins() const { return PipelineStages::of_latency(latency_cycles); }
  PipelineStages of_late_tests() const { return PipelineStages::of_latency(latency_cycles, quads_per_cycle); }
  /// Of beats of colours.
  PipelineStages of_colors() const {
    return PipelineStages::of_latency(latency_cycles, ColorBeat::in_a_cycle(color_rate));
  }
  /// As in PropWork.
  std::vector<WorkKind> kinds() const {
    return {{"bins", 0, 1.0 / quads_per_cycle, false},
            {"survivors", 1, 1.0 / quads_per_cycle, false},
            {"colours", 2, 1.0 / color_rate.per_cycle(), true},
            {"empty warps", 2, 1.0 / color_rate.items, false},
            {"late tests", 3, 1.0 / quads_per_cycle, false}};
  }
};

/// Pre-ROP (paper 3.1, 5.1): orchestrates the flow of quads and keeps the blending order.
class PreRop : public PropBehaviour {
 public:
  using Parameters = PropParameters;
  PreRop(const Parameters& parameters, const RenderContext& context) : time_(parameters, context.format) {}

  const PropTime& time() const override { return time_; }

 private:
  const PropTime time_;
};

}  // namespace vrpipe
