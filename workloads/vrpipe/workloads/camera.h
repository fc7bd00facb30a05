#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

namespace vrpipe {

using Vec3 = glm::dvec3;

/// Largest width and height of an image, pixels.
constexpr std::uint32_t kMaxImageSize = 16384;

struct ImageSize {
  std::uint32_t width = 0, height = 0;  ///< pixels, 1 to kMaxImageSize
};

/// A pinhole camera in the INRIA frame: x right, y down, z forward; square pixels with centres at +0.5; the
/// principal point is the centre of the image.
struct Camera {
  Vec3 eye{};  ///< camera centre, world units
  std::array<Vec3, 3> rotation{
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< camera to world, rows; columns right, down, forward
  double fx = 1, fy = 1;                   ///< focal lengths, pixels
  std::uint32_t width = 1, height = 1;     ///< pixels
  float near_plane = 0.2f;    ///< world units, >= 1e-6; Gaussians at camera z <= near_plane are culled (0.2 as INRIA)
  float far_plane = 1000.0f;  ///< world units, above near_plane, finite; meshes end here, Gaussians do not
  std::string name;           ///< of the image that it took, as its file has it; empty without
};

/// A point of the world, as the camera sees it: right, down and forward of the eye, world units. Its window position is
/// width / 2 + fx x / z, height / 2 + fy y / z.
Vec3 camera_space(const Camera& camera, const Vec3& world);

/// Window depth at camera z, of meshes and of splats: 0 at the near plane, 1 at the far plane, linear in 1 / z, as OpenGL's
/// perspective with a clip volume of 0 to 1. What is not between the planes is clamped to them.
double window_depth(const Camera& camera, double z);

/// Where a camera stands and what it looks at, without the image.
struct View {
  Vec3 eye{};
  Vec3 look_at{0, 0, 1};
  Vec3 up{0, -1, 0};         ///< the world's up direction; y points down in COLMAP and INRIA worlds
  double fovy_degrees = 50;  ///< vertical field of view
};

/// The camera at `eye` that looks at `target`, its image upright with respect to the world direction `up`.
/// @throws UserError when a value is not finite, eye == target, up is zero or parallel to the view direction,
///         fovy is not in [1e-6, 180 - 1e-3) degrees, or a side of the image is not in 1 to kMaxImageSize
Camera look_at(const Vec3& eye, const Vec3& target, const Vec3& up, double fovy_degrees, std::uint32_t width,
               std::uint32_t height);
Camera look_at(const View& view, ImageSize size);

/// The same camera with another image size. Keeps the vertical field of view and square pixels: the focal lengths
/// scale by the ratio of the heights.
/// @throws UserError when a side is not in 1 to kMaxImageSize
Camera resized(const Camera& camera, ImageSize size);

/// The views that go round `view.look_at` on a level circle through `view.eye`: `count` of them at equal angles around
/// `view.up`, counter-clockwise as seen from above. The first is `view` itself.
/// @throws UserError when `view` has no up
std::vector<View> orbit_views(const View& view, std::size_t count);

/// Reads all cameras of a file, or of a folder. Which of these it is, its content says:
/// INRIA cameras.json: an array of {"width", "height", "position": [3] = camera centre, "rotation": [3][3] camera to world,
/// "fx", "fy" in pixels, "img_name"}.
/// NeRF transforms.json (Blender, instant-ngp, nerfstudio): {"frames": [{"transform_matrix": [4][4] camera to world of a
/// camera whose x is right, y up and z back, "file_path"}]} with "fl_x", "fl_y", "w", "h" in pixels or "camera_angle_x",
/// "camera_angle_y" in radians, of a frame or of all. Without a size images are 800x800, as in NeRF's synthetic data
/// sets. A camera that is distorted or no pinhole, and a matrix that scales, are refused.
/// COLMAP model: cameras and images, both .bin or both .txt, in a folder, in its sparse/0 or in its sparse; or the name of
/// one of the files. Cameras are in the order of their images' names. Camera models other than SIMPLE_PINHOLE and PINHOLE
/// are refused unless they are one, with all distortion 0.
/// Other keys and files are ignored, as principal points are: as in the INRIA code, they are taken to be in the centre.
/// @throws UserError naming the camera, the line or the byte when a file cannot be read or a camera in it cannot be used
std::vector<Camera> load_cameras(const std::string& path);

/// The files that load_cameras(path) reads, as far as their names tell.
std::vector<std::filesystem::path> camera_files(const std::string& path);

/// A camera of a file.
struct CameraName {
  std::string file;
  std::size_t index = 0;  ///< in load_cameras(file)
  std::string image;      ///< Camera::name
};

/// FILE, or FILE#CAMERA.
struct CameraChoice {
  std::string file;
  std::optional<std::string> camera;  ///< none: the text does not say
};

/// What `text` says. All of it is the file's name if there is such a file.
CameraChoice camera_choice(const std::string& text);

struct NamedCamera {
  Camera camera;
  CameraName name;
};

/// The camera that `text` names: FILE, the first; FILE#INDEX, index from 0; or FILE#NAME, an image's name as the file has
/// it, or, where that leaves no doubt, without its folder or its extension. A number is an index; with leading zeros it
/// is a name.
/// @throws UserError as load_cameras, and when there is no such camera or more than one
NamedCamera camera_from_file(const std::string& text, const std::optional<ImageSize>& size = std::nullopt);

/// Checks all that projections need of a camera: the image's size, finite elements, focal lengths above 0, and
/// 1e-6 <= near_plane < far_plane.
/// @throws UserError that begins with `what`, e.g. "cannot preprocess the scene"
void check_camera(const Camera& camera, const std::string& what);

/// @throws UserError unless both sides are 1 to kMaxImageSize; `where` names the option or file
void check_image_size(std::uint64_t width, std::uint64_t height, const std::string& where);

}  // namespace vrpipe
