// PlayCanvas' SOG (Spatially Ordered Gaussians), versions 1 and 2: lossless WebP images with a Gaussian a pixel, and a meta.json
// that says what their channels mean; in a zip archive or in a folder.
// https://developer.playcanvas.com/user-manual/gaussian-splatting/formats/sog
#include "formats/attribute_codes.h"
#include "formats/scene_format.h"
#include "formats/sog_scene.h"

namespace vrpipe {
namespace {

Match matches_sog(const SceneFile& file) {
  if (is_zip(file.bytes)) return Match::by_container;
  return file.name == "meta.json" || file.ends_with(".sog") ? Match::by_name : Match::no;
}

GaussianFile read_sog(const SceneFile& file) {
  if (file.ends_with(".sog") && !is_zip(file.bytes)) {
    file.bytes.fail_at(0, "there is no zip archive, which a .sog is", "get the file again");
  }
  const SogScene scene(file.bytes, file.neighbour);
  GaussianArray gaussians(scene.count(), scene.sh_degree(), file.bytes.where());
  scene.decode({{0, scene.count(), 0}}, gaussians);
  GaussianFile result;
  result.gaussians = gaussians.build();
  if (!scene.anti_aliased().empty()) set_anti_aliased(result, scene.anti_aliased());
  return result;
}

const SceneFormatRegistrar sog_registrar(
    {"PlayCanvas SOG",
     "FILE.sog, or a folder with a meta.json",
     "WebP images in a zip archive or a folder, about 15 bytes a Gaussian; versions 1 and 2",
     {},
     matches_sog,
     read_sog});

}  // namespace
}  // namespace vrpipe
