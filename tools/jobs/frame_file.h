#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

/// A scene, some of its splats, or a mesh, drawn with a state of its own.
struct SceneDraw {
  std::string scene;     ///< as SceneRequest has it, or the file of a mesh
  bool is_mesh = false;  ///< the latter
  std::string name;      ///< for reports
  // As Frame::draw takes them: in draw order, of the splats that are visible.
  std::uint32_t first = 0;
  std::uint32_t splats = ~0U;
  bool blend = true;
  std::optional<bool> early_termination;  ///< none: unless the draw does not blend
  bool late_tests = false;
  std::vector<Setting> settings;  ///< of unit `state`: those that draws may have of their own
  // Those of DrawState; none where the draw does not say.
  std::optional<DepthState> depth;
  std::optional<StencilState> stencil;
  std::optional<FragmentShader> shader;
  std::optional<CullMode> cull;
};

struct FrameCommand {
  std::string where;              ///< for messages: the file and the command's number
  std::optional<SceneDraw> draw;  ///< none: a clear
  Clear clear;
};

/// What a frame draws, before anything is loaded.
struct FrameDescription {
  std::string name;  ///< in results: the scene's, or the file's without folder
  std::vector<FrameCommand> commands;
  std::uint32_t passes = 1;  ///< in which the splats of a scene are drawn (draw_in_passes)
};

/// Of the frame's commands, those up to its `count`th draw are left. Throws UserError if it has fewer.
void leave_out_draws_after(std::size_t count, FrameDescription& frame);

/// A frame of one draw.
FrameDescription frame_of_scene(const std::string& scene);

/// Reads a frame file, which docs/frames.md describes. Names of files in it are relative to its folder.
/// Throws UserError naming the file, the command and the key for whatever cannot be used.
FrameDescription read_frame_file(const std::filesystem::path& path);

}  // namespace vrpipe::tools
