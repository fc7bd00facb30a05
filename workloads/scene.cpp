#include <vrpipe/workloads/scene.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/draw_list.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/portable_math.h>
#include <vrpipe/workloads/scene_substitution.h>

#include "file_io.h"

namespace vrpipe {
namespace {

constexpr char kCannotUseOption[] = "cannot use option";

/// The view with what the user named in place of what was there.
View with_options(View view, const SceneRequest& request) {
  if (request.eye) view.eye = *request.eye;
  if (request.look_at) view.look_at = *request.look_at;
  view.up_source = scene_name(request.scene);
  if (request.up) {
    view.up = *request.up;
    view.up_source = View().up_source;
  }
  if (request.fovy_degrees) view.fovy_degrees = *request.fovy_degrees;
  view.orthographic_height = request.orthographic_height;
  return view;
}

/// The automatic view that open_scene documents, for what the user did not name.
/// @throws UserError when the Gaussians lie so far out that a camera beside them rounds to where they are
View automatic_view(const std::string& path, const GaussianFile& file, const SceneRequest& request) {
  const GaussianScene& scene = file.gaussians;
  View view;
  view.up = request.up.value_or(file.up);
  if (!request.up) view.up_source = path;
  if (request.fovy_degrees) view.fovy_degrees = *request.fovy_degrees;
  view.orthographic_height = request.orthographic_height;
  // Quantiles of a sample: trained scenes hold a few Gaussians very far out.
  constexpr std::uint64_t kSample = 100000;
  const std::uint64_t step = scene.size() / kSample + 1;
  std::array<std::vector<float>, 3> coordinates;
  std::vector<float> sizes;
  for (std::uint64_t i = 0; i < scene.size(); i += step) {
    const std::array<float, 3> position = scene[i].position();
    if (!std::isfinite(position[0]) || !std::isfinite(position[1]) || !std::isfinite(position[2])) continue;
    const std::array<float, 3> log_scale = scene[i].log_scale();
    if (!(log_scale[0] == log_scale[0] && log_scale[1] == log_scale[1] && log_scale[2] == log_scale[2])) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) coordinates[axis].push_back(position[axis]);
    sizes.push_back(std::max(log_scale[0], std::max(log_scale[1], log_scale[2])));
  }
  double squares = 0, size = 0;
  Vec3 middle{};
  if (!sizes.empty()) {
    // Of few values, the low quantile is the least and the high one the greatest.
    const auto quantile = [](std::vector<float>& values, std::size_t tenths) {
      std::sort(values.begin(), values.end());
      const std::size_t last = values.size() - 1;
      return static_cast<double>(values[(last * tenths + (tenths > 5 ? 9 : 0)) / 10]);
    };
    for (std::size_t axis = 0; axis < 3; ++axis) {
      middle[axis] = scene.origin()[axis] + quantile(coordinates[axis], 5);
      const double half = 0.5 * quantile(coordinates[axis], 9) - 0.5 * quantile(coordinates[axis], 1);
      squares += half * half;
    }
    size = portable_exp(std::min(quantile(sizes, 5), 80.0));
  }
  view.look_at = request.look_at.value_or(middle);
  if (request.eye) {
    view.eye = *request.eye;
    return view;
  }
  // Not nearer than three sigmas of the median Gaussian, nor than the near plane lets anything be seen.
  const double radius = std::max(std::sqrt(squares), std::max(3.0 * size, 0.5));
  // Out of range fields of view are refused by look_at.
  const double half_fov = std::min(std::max(0.5 * view.fovy_degrees, 1.0), 80.0);
  const double distance = radius / portable_sin(half_fov * 3.14159265358979323846 / 180.0);
  // From the front (-z, or what of it is horizontal), 30 degrees to the left, 20 above.
  Vec3 up = view.up * (1.0 / std::max(glm::length(view.up), 1e-300));
  if (!(glm::length(up) > 0.5)) up = {0, -1, 0};  // refused by look_at
  Vec3 front = Vec3{0, 0, -1} + up * up[2];
  if (glm::length(front) < 1e-3) front = {0, 1, 0};
  front *= 1.0 / glm::length(front);
  const Vec3 left = glm::cross(front, up);
  constexpr double kSin20 = 0.3420201433256687, kCos20 = 0.9396926207859084, kSin30 = 0.5, kCos30 = 0.8660254037844386;
  const Vec3 level = front * kCos30 + left * kSin30;
  const Vec3 direction = level * kCos20 + up * kSin20;
  view.eye = view.look_at + direction * distance;
  const double there = glm::length(view.eye - view.look_at);
  if (!request.look_at && !(std::fabs(there - distance) <= 0.01 * distance)) {
    throw UserError("cannot choose a view", path,
                    fmt::format("its Gaussians lie around {:g},{:g},{:g}, too far out for a camera {:g} beside them",
                                view.look_at[0], view.look_at[1], view.look_at[2], distance),
                    "move the scene to the origin, or give --camera, or --eye and --look-at");
  }
  return view;
}

void refuse(bool given, const std::string& option, const std::string& why, const std::string& remedy) {
  if (given) throw UserError(kCannotUseOption, option, why, remedy);
}

void check_view_options(const SceneRequest& request) {
  refuse(request.fovy_degrees && request.orthographic_height, "--fovy", "--orthographic is without perspective",
         "give one or the other");
  if (!request.camera) return;
  const std::string why = "--camera gives a whole camera";
  const std::string remedy = "give one or the other";
  refuse(request.eye.has_value(), "--eye", why, remedy);
  refuse(request.look_at.has_value(), "--look-at", why, remedy);
  refuse(request.up.has_value(), "--up", why, remedy);
  refuse(request.fovy_degrees.has_value(), "--fovy", why, remedy);
  refuse(request.orthographic_height.has_value(), "--orthographic", why, remedy);
}

LoadedScene load_draw_list(const std::string& path, const SceneRequest& request) {
  const std::string why = "a .spl is a draw list: its camera and size are part of it";
  const std::string remedy = "leave the option out, or give the .ply";
  refuse(request.size.has_value(), "--size", why, remedy);
  refuse(request.camera.has_value(), "--camera", why, remedy);
  refuse(request.eye.has_value(), "--eye", why, remedy);
  refuse(request.look_at.has_value(), "--look-at", why, remedy);
  refuse(request.up.has_value(), "--up", why, remedy);
  refuse(request.fovy_degrees.has_value(), "--fovy", why, remedy);
  refuse(request.orthographic_height.has_value(), "--orthographic", why, remedy);
  refuse(!request.meshes.empty(), "--mesh", "a .spl is a draw list, which has no camera and no depth", remedy);
  const std::string preprocessed = "a .spl is a draw list, preprocessed already";
  const PreprocessOptions untouched;
  refuse(request.preprocess.sh_degree != untouched.sh_degree, "--set preprocess.sh_degree", preprocessed, remedy);
  refuse(request.preprocess.depth_key_bits != untouched.depth_key_bits, "--set preprocess.depth_key_bits", preprocessed,
         remedy);
  refuse(request.preprocess.dilation != untouched.dilation, "--set preprocess.dilation", preprocessed, remedy);
  refuse(request.preprocess.opacity_compensation != untouched.opacity_compensation,
         "--set preprocess.opacity_compensation", preprocessed, remedy);
  DrawList list = read_draw_list(path);
  LoadedScene loaded;
  loaded.draw = std::move(list.draw);
  loaded.summary.gaussians_total = list.splats_in_file;
  loaded.summary.gaussians_visible = loaded.draw.splats.size();
  loaded.summary.rejected.not_finite = list.dropped_not_finite;
  return loaded;
}

/// The camera of the file given, or that of a view, which is only asked for if there is none.
template <class MakeView>
Viewpoint viewpoint(const SceneRequest& request, ImageSize default_size, const MakeView& make_view) {
  if (request.camera) {
    NamedCamera named = camera_from_file(*request.camera, request.size, request.lenses);
    return {std::move(named.camera), {}, std::move(named.name)};
  }
  const View view = make_view();
  return {look_at(view, request.size.value_or(default_size)), view, {}};
}

/// A mesh in the place of Gaussians, which it lacks in more than one way.
void refuse_mesh(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored) || !is_mesh_file(path)) return;
  throw UserError("cannot read scene", path, "it is a triangle mesh, no Gaussians", "draw it with a scene, as a mesh");
}

Viewpoint viewpoint_in(const BuiltinSceneInfo& builtin, const SceneRequest& request) {
  return viewpoint(request, builtin.size, [&] { return with_options(builtin.view, request); });
}

Viewpoint viewpoint_in(const GaussianFile& file, const SceneRequest& request) {
  return viewpoint(request, kDefaultImageSize, [&] { return automatic_view(request.scene, file, request); });
}

void open_builtin(const std::string& name, const SceneRequest& request, OpenedScene& scene) {
  const BuiltinScene builtin = request.scene_cache ? cached_builtin_scene(name) : make_builtin_scene(name);
  scene.gaussians = builtin.gaussians;
  scene.meshes = builtin.meshes;
  scene.viewpoint = viewpoint_in(builtin.info, request);
}

void open_file(const SceneRequest& request, OpenedScene& scene) {
  GaussianFile file = open_gaussians(request.scene);
  scene.viewpoint = viewpoint_in(file, request);
  scene.gaussians = std::move(file.gaussians);
  scene.notes = std::move(file.notes);
}

void read_meshes(const SceneRequest& request, OpenedScene& scene) {
  for (const std::string& file : request.meshes) {
    scene.meshes.push_back(std::make_shared<const Mesh>(read_mesh(file, scene.rejected_triangles)));
  }
}

/// The size of the built-in scene remains; the view does not fit another model.
SceneRequest of_file(SceneRequest request, const SceneSubstitution& in_place) {
  request.scene = in_place.file;
  if (!request.size && !is_draw_list(in_place.file)) request.size = builtin_scene_named(in_place.name).size;
  return request;
}

}  // namespace

std::string scene_name(const std::string& scene) {
  if (scene.empty()) return builtin_prefix + kDefaultBuiltinScene;
  if (const auto in_place = scene_substitution(scene)) return in_place->name + "=" + scene_name(in_place->file);
  if (builtin_name_of(scene)) return scene;
  const std::filesystem::path path(scene);
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

bool is_draw_list(const std::string& scene) { return !builtin_name_of(scene) && extension_of(scene) == ".spl"; }

GaussianFile open_gaussians(const std::string& scene) {
  if (const auto in_place = scene_substitution(scene)) return open_gaussians(in_place->file);
  const std::string name = scene_name(scene);
  if (const auto builtin = builtin_name_of(name)) {
    GaussianFile file;
    file.gaussians = cached_builtin_scene(*builtin).gaussians;
    file.format = "built-in";
    return file;
  }
  if (is_draw_list(scene)) {
    throw UserError("cannot read scene", scene,
                    "a .spl is a draw list: splats on a screen, without a place in the world",
                    "give the scene that it was made from");
  }
  const std::filesystem::path path = gaussian_file_path(scene);
  std::error_code ignored;
  if (!path.has_extension() && !std::filesystem::exists(path, ignored)) {
    throw UserError("cannot read scene", scene, "no such file",
                    "check the path, or take a built-in scene: " +
                        suggestion(scene, builtin_scene_names(), "", builtin_prefix));
  }
  refuse_mesh(path.string());
  return read_gaussian_file(scene);
}

View view_of(const std::string& scene, const GaussianFile& gaussians) {
  const auto builtin = builtin_name_of(scene_name(scene));
  return builtin ? builtin_scene_named(*builtin).view : automatic_view(scene, gaussians, {});
}

std::optional<Viewpoint> viewpoint_of(const SceneRequest& request) {
  if (const auto in_place = scene_substitution(request.scene)) return viewpoint_of(of_file(request, *in_place));
  if (is_draw_list(request.scene)) return std::nullopt;
  check_view_options(request);
  if (const auto builtin = builtin_name_of(scene_name(request.scene)))
    return viewpoint_in(builtin_scene_named(*builtin), request);
  return viewpoint_in(open_gaussians(request.scene), request);
}

OpenedScene open_scene(const SceneRequest& request) {
  if (const auto in_place = scene_substitution(request.scene)) {
    OpenedScene scene = open_scene(of_file(request, *in_place));
    scene.name = scene_name(request.scene);
    return scene;
  }
  if (request.size) check_image_size(request.size->width, request.size->height, "--size");
  OpenedScene scene;
  scene.name = scene_name(request.scene);
  if (const auto builtin = builtin_name_of(scene.name)) {
    check_view_options(request);
    open_builtin(*builtin, request, scene);
    read_meshes(request, scene);
    return scene;
  }
  if (is_draw_list(request.scene)) {
    scene.draw_list = load_draw_list(request.scene, request);
    return scene;
  }
  check_view_options(request);
  open_file(request, scene);
  read_meshes(request, scene);
  return scene;
}

LoadedScene preprocess_scene(const OpenedScene& scene, const PreprocessOptions& options) {
  LoadedScene loaded;
  if (scene.draw_list) {
    loaded = *scene.draw_list;
  } else {
    loaded.draw = preprocess(scene.gaussians, scene.viewpoint.camera, options, loaded.summary);
    // What cannot be drawn was left out when they were read, or made without.
    loaded.rejected_triangles = scene.rejected_triangles;
    for (const auto& mesh : scene.meshes) {
      loaded.meshes.push_back(project_mesh(*mesh, scene.viewpoint.camera, loaded.rejected_triangles));
      loaded.summary.triangles += loaded.meshes.back().mesh.size();
    }
    loaded.summary.triangles_rejected = loaded.rejected_triangles.total();
    loaded.summary.notes = scene.notes;
    const std::vector<std::string>& of_camera = scene.viewpoint.camera.notes;
    loaded.summary.notes.insert(loaded.summary.notes.end(), of_camera.begin(), of_camera.end());
    loaded.viewpoint = scene.viewpoint;
    loaded.preprocessed_here = true;
  }
  loaded.summary.name = scene.name;
  return loaded;
}

LoadedScene load_scene(const SceneRequest& request) {
  OpenedScene scene = open_scene(request);
  if (!scene.draw_list) return preprocess_scene(scene, request.preprocess);
  scene.draw_list->summary.name = scene.name;
  return std::move(*scene.draw_list);
}

}  // namespace vrpipe
