#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/scene.h>

#include "jobs/frame_file.h"

namespace vrpipe::tools {

/// A frame's scenes, preprocessed for one camera.
struct LoadedFrame {
  std::uint32_t width = 0, height = 0;                           ///< pixels
  std::vector<std::shared_ptr<const Draw>> geometry;             ///< of each command; null for a clear
  std::vector<std::vector<std::shared_ptr<const Draw>>> meshes;  ///< of the scene of each command
  SceneSummary summary;                                          ///< sums over the scenes, each of which counts once
  std::optional<Viewpoint> viewpoint;                            ///< none if there are only draw lists
  bool preprocessed_here = false;                                ///< false if there are only draw lists
};

/// Loads every scene of a frame once. All are drawn with one camera and size: those of `options`, in which `scene` is
/// not used, and what these leave open as the first scene has it that is no draw list. A draw list has no camera, and
/// must be of the frame's size.
/// Throws UserError as load_scene(), and for splats that a scene does not have.
LoadedFrame load_frame(const FrameDescription& frame, const SceneRequest& options);

/// The same of a frame of one scene (frame_of_scene) that is open already, with its viewpoint.
LoadedFrame load_frame(const FrameDescription& frame, const OpenedScene& scene, const PreprocessOptions& options);

/// The frame of a request, which gives draws their states.
std::shared_ptr<const Frame> make_frame(const RunRequest& request, const FrameDescription& description,
                                        const LoadedFrame& loaded);

}  // namespace vrpipe::tools
