#include "sm/mesh_shader.h"

#include <algorithm>
#include <cmath>

namespace vrpipe {

namespace {

/// colour times (ambient + (1 - ambient) max(0, n . l)): that factor. Without a normal nothing but the ambient light.
double lit(const Light& light, double nx, double ny, double nz) {
  const double squared = nx * nx + ny * ny + nz * nz;
  const double ambient = light.ambient;
  if (!(squared > 0)) return ambient;
  const double cosine =
      (nx * static_cast<double>(light.x) + ny * static_cast<double>(light.y) + nz * static_cast<double>(light.z)) /
      std::sqrt(squared);
  return ambient + (1 - ambient) * std::max(0.0, cosine);
}

}  // namespace

QuadColor MeshShader::shade(const Quad& quad, std::int32_t x, std::int32_t y) {
  const DrawCall& call = context_.draw(quad.draw);
  const std::array<MeshVertex, 3>& vertices = call.mesh_triangle(quad.splat).vertices;
  Entry& entry = entries_[quad.splat % entries_.size()];
  if (entry.splat != quad.splat) {
    SnappedTriangle snapped;
    snap_triangle(context_, quad.draw, quad.splat, quad.triangle, snapped);
    entry = {quad.splat, BarycentricWeights(snapped, context_.precision.subpixel_bits)};
  }
  QuadColor color{};
  for (unsigned lane = 0; lane < 4; ++lane) {
    if ((quad.coverage >> lane & 1U) == 0) continue;
    std::array<double, 3> of_vertex =
        entry.weights.at(x + static_cast<std::int32_t>(lane & 1U), y + static_cast<std::int32_t>(lane >> 1U));
    double sum = 0;
    for (unsigned i = 0; i < 3; ++i) sum += of_vertex[i] *= static_cast<double>(vertices[i].inverse_w);
    const auto attribute = [&](float MeshVertex::*member) {
      double value = 0;
      for (unsigned i = 0; i < 3; ++i) value += of_vertex[i] * static_cast<double>(vertices[i].*member);
      return value / sum;
    };
    double factor = 1;
    if (call.state.shader == FragmentShader::lit) {
      factor =
          lit(call.state.light, attribute(&MeshVertex::nx), attribute(&MeshVertex::ny), attribute(&MeshVertex::nz));
    }
    color.red[lane] = static_cast<float>(attribute(&MeshVertex::red) * factor);
    color.green[lane] = static_cast<float>(attribute(&MeshVertex::green) * factor);
    color.blue[lane] = static_cast<float>(attribute(&MeshVertex::blue) * factor);
    color.alpha[lane] = 1;
  }
  return color;
}

}  // namespace vrpipe
