#include <vrpipe/workloads/mixed_frame.h>

#include <cmath>
#include <string>
#include <utility>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/multi_pass.h>

namespace vrpipe {
namespace {

void check(const MixedFrameOptions& options) {
  constexpr char kCannot[] = "cannot draw meshes";
  if (options.mesh_shader != FragmentShader::lit && options.mesh_shader != FragmentShader::vertex) {
    throw UserError(kCannot, "shader", "it is none for the colour of a mesh", "use lit or vertex");
  }
  const Light& light = options.light;
  const double x = light.x, y = light.y, z = light.z;
  const double length = std::sqrt(x * x + y * y + z * z);
  const bool good = std::fabs(length - 1) <= 1e-3 && light.ambient >= 0 && light.ambient <= 1;
  if (!good) {
    throw UserError(kCannot, "light", "its direction is not of unit length, or its ambient share not 0 to 1",
                    "divide the direction by its length");
  }
}

/// Of a mesh, but for depth.
DrawState mesh_state(FragmentShader shader, DepthState depth) {
  DrawState state;
  state.cull = CullMode::back;
  state.shader = shader;
  state.depth = depth;
  return state;
}

}  // namespace

std::shared_ptr<Frame> mixed_frame(const Draw& splats, const std::vector<Draw>& meshes,
                                   const MixedFrameOptions& options) {
  const auto shared = [](const Draw& draw) { return std::shared_ptr<const Draw>(&draw, [](const Draw*) {}); };
  auto frame = std::make_shared<Frame>(splats.width, splats.height);
  std::vector<std::shared_ptr<const Draw>> of_meshes;
  for (const Draw& mesh : meshes) of_meshes.push_back(shared(mesh));
  draw_mixed(*frame, shared(splats), of_meshes, options, meshes.empty() ? "" : "splats");
  return frame;
}

void draw_mixed(Frame& frame, std::shared_ptr<const Draw> splats,
                const std::vector<std::shared_ptr<const Draw>>& meshes, const MixedFrameOptions& options,
                const std::string& name, std::uint32_t first, std::uint32_t count) {
  if (meshes.empty())
    return draw_in_passes(frame, std::move(splats), options.splats, options.passes, name, first, count);
  check(options);
  const auto draw_meshes = [&](const DrawState& state, const std::string& what) {
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      if (meshes[i]->is_mesh()) frame.draw(meshes[i], state, what + " of mesh " + std::to_string(i));
    }
  };
  draw_meshes(mesh_state(FragmentShader::none, {true, Compare::less, true}), "depth");
  DrawState splat_state = options.splats;
  splat_state.depth = {true, Compare::less, false};
  draw_in_passes(frame, std::move(splats), splat_state, options.passes, name, first, count);
  DrawState colour = mesh_state(options.mesh_shader, {true, Compare::equal, false});
  if (options.mesh_shader == FragmentShader::lit) colour.light = options.light;
  draw_meshes(colour, "colour");
}

}  // namespace vrpipe
