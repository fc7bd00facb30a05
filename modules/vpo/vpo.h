#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/slots/vpo.h>

namespace vrpipe {

/// Vertex processing and operations: two triangles per splat, culling, viewport clip, bounding box (paper 5.1).
class PrimitiveAssembly : public VpoBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer triangles_per_cycle{*this,
                                "triangles_per_cycle",
                                2,
                                1,
                                16,
                                "triangles",
                                "ATTILA: primitive assembly and set-up take 2 triangles a cycle",
                                "triangles assembled, culled and boxed in a cycle"};
    Integer latency_cycles{*this,
                           "latency_cycles",
                           10,
                           1,
                           1000,
                           "cycles",
                           "Emerald: bounding box 4 cycles; ATTILA: clipper 6 cycles",
                           "from the last vertex to the primitive behind it"};
  };
  PrimitiveAssembly(const Parameters& parameters, const RenderContext& context);

  unsigned assemble(DrawIndex draw, std::uint32_t splat, std::array<Primitive, 2>& out) override;
  Throughput timing() const override { return {triangles_per_cycle_, latency_cycles_}; }

  Counter culled_zero_area{*this, "culled_zero_area", "triangles", "without area after snapping"};
  Counter culled_facing{*this, "culled_facing", "triangles", "that face the way their draw culls"};
  Counter culled_outside{*this, "culled_outside", "triangles", "that cover no sample of the viewport's pixels"};
  Counter dropped_not_finite{*this, "dropped_not_finite", "splats",
                             "with a NaN or infinite attribute, or a vertex that cannot be cut to the guard band"};
  MinMax smallest_determinant{*this, MinMax::Of::smallest, "smallest_determinant", "1e-6 px^2",
                              "of a splat's axes in sigmas, the product of its standard deviations; the projection's "
                              "dilation leaves 300000 or more, 0 is a splat without area"};

 private:
  const RenderContext& context_;
  const std::uint32_t triangles_per_cycle_;
  const std::uint32_t latency_cycles_;
  EffectGate face_culling_gate_;
};

}  // namespace vrpipe
