#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/slots/prop.h>

namespace vrpipe {

/// Pre-ROP (paper 3.1, 5.1): orchestrates the flow of quads and keeps the blending order.
class PreRop : public PropBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer quads_per_cycle{*this,
                            "quads_per_cycle",
                            16,
                            1,
                            16,
                            "quads",
                            source::open,
                            "from TC to ZROP and on to QRU; must exceed what the shaders and CROP can take by the "
                            "share that termination kills"};
    Integer color_bytes_per_cycle{
        *this,
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
  PreRop(const Parameters& parameters, const RenderContext& context);

  TimingParameters timing() const override { return timing_; }

 private:
  TimingParameters timing_;
};

}  // namespace vrpipe
