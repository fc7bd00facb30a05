#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/workloads/camera.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/gaussian_scene.h>
#include <vrpipe/workloads/mesh.h>
#include <vrpipe/workloads/preprocess.h>

namespace vrpipe {

/// What the user asked to draw; field by field the options --scene, --size, --camera, --eye, --look-at, --up, --fovy,
/// --orthographic and --undistorted.
struct SceneRequest {
  /// A file of Gaussians, see read_gaussian_file(); FILE.spl; builtin:NAME; or NAME=FILE. Empty: builtin:object.
  std::string scene;
  std::optional<ImageSize> size;
  std::optional<std::string> camera;   ///< as camera_from_file takes it; excludes the five below
  Lenses lenses = Lenses::as_written;  ///< of the cameras of the file
  std::optional<Vec3> eye;
  std::optional<Vec3> look_at;
  std::optional<Vec3> up;
  std::optional<double> fovy_degrees;
  std::optional<double> orthographic_height;  ///< as View has it; excludes the field of view
  PreprocessOptions preprocess;
  bool scene_cache = true;  ///< a built-in scene may come from the user's cache folder; see cached_builtin_scene()
  std::vector<std::string> meshes;  ///< files of meshes that are drawn with the scene, in this order; see read_mesh()
};

/// The camera of a draw, and where it comes from.
struct Viewpoint {
  Camera camera;
  std::optional<View> view;        ///< that the camera was made from; none for a camera of a file
  std::optional<CameraName> file;  ///< that the camera was read from
};

struct LoadedScene {
  Draw draw;
  std::vector<Draw> meshes;              ///< those of the built-in scene, then those of the files; see mixed_frame()
  RejectedTriangles rejected_triangles;  ///< of all meshes
  SceneSummary summary;                  ///< name: see scene_name()
  std::optional<Viewpoint> viewpoint;    ///< none for a draw list
  bool preprocessed_here = false;        ///< false for a draw list
};

/// Image size of a file of Gaussians that is drawn without a camera file or a size.
constexpr ImageSize kDefaultImageSize{1280, 720};

/// A scene that can be preprocessed more than once: Gaussians and a camera, or a draw list, which is preprocessed
/// already.
struct OpenedScene {
  std::string name;  ///< as SceneSummary has it
  GaussianScene gaussians;
  Viewpoint viewpoint;
  std::vector<std::shared_ptr<const Mesh>> meshes;
  RejectedTriangles rejected_triangles;  ///< when they were read
  std::optional<LoadedScene> draw_list;
  std::vector<std::string> notes;  ///< as GaussianFile has them
};

/// The name that results give to the scene of SceneRequest::scene: the file's without folder, builtin:NAME, or NAME= and
/// the file's without folder.
std::string scene_name(const std::string& scene);

/// Whether a scene is a draw list (.spl), which has a size and no camera.
bool is_draw_list(const std::string& scene);

/// The Gaussians that `scene` names: a file, or builtin:NAME.
/// @throws UserError for what has none, a draw list or a mesh, and as read_gaussian_file()
GaussianFile open_gaussians(const std::string& scene);

/// Where open_scene() puts the camera if nothing is said about it.
/// @throws UserError when the Gaussians lie so far out that a camera beside them rounds to where they are
View view_of(const std::string& scene, const GaussianFile& gaussians);

/// Where open_scene() puts the camera, without making a built-in scene; none for a draw list. Throws as open_scene().
std::optional<Viewpoint> viewpoint_of(const SceneRequest& request);

/// Opens a scene.
/// Built-in: its own camera and size; view options replace what they name, the rest stays.
/// Gaussians of a file: the camera of the file given, or the view options. What is not given comes from an automatic view: it looks
/// at the median position from a distance at which the middle 80 % of the positions fit (a ball of radius 0.5 and of
/// three median sigmas at least), from the front (-z), 30 degrees to the left and 20 degrees above, with the world's
/// up where the file says it is, else at 0,-1,0 (y points down, as in INRIA and COLMAP worlds; give --up 0,1,0 for y-up
/// files), and a vertical field of view of 50 degrees. Without perspective it stands where a perspective would. A scene so far out that a camera beside it rounds to where it is gets none.
/// NAME=FILE: the file in the place of the built-in scene NAME, whose size it has unless the request gives one; see
/// scene_substitution(). The view is that of a file.
/// .spl: the draw as it is; size, camera, view options, meshes and preprocessing other than the default are
/// refused.
/// @throws UserError for whatever cannot be used
OpenedScene open_scene(const SceneRequest& request);

/// Preprocesses an opened scene, its meshes included; of a draw list, a copy.
/// @throws UserError as preprocess() and project_mesh()
LoadedScene preprocess_scene(const OpenedScene& scene, const PreprocessOptions& options);

/// Opens a scene and preprocesses it. Throws as these do.
LoadedScene load_scene(const SceneRequest& request);

}  // namespace vrpipe
