#pragma once

#include <cstdint>
#include <string_view>

namespace vrpipe {

/// The extension of glTF 2.0 for Gaussians.
constexpr char kGltfGaussians[] = "KHR_gaussian_splatting";

/// Whether a document speaks of them, as one that has them does.
inline bool mentions_gaussians(std::string_view document) {
  return document.find(kGltfGaussians) != std::string_view::npos;
}

constexpr char kGlbMagic[] = "glTF";

/// Whether a file begins as glTF does: as a .glb, or with the { of its JSON.
inline bool begins_as_gltf(std::string_view bytes) {
  if (bytes.substr(0, 4) == kGlbMagic) return true;
  const std::size_t first = bytes.find_first_not_of("\xef\xbb\xbf \t\r\n");
  return first != std::string_view::npos && bytes[first] == '{';
}
constexpr char kNoGltf[] = "it is no glTF: it begins neither with the letters glTF, as a .glb, nor with the { of JSON";

struct GlbChunk {
  static constexpr std::uint32_t json = 0x4e4f534a, binary = 0x004e4942;
  std::uint32_t bytes, kind;
};

/// What a .glb begins with. Its document follows, and then, at a multiple of 4, perhaps the chunk of a buffer.
struct GlbStart {
  char magic[4];
  std::uint32_t version, bytes;
  GlbChunk document;

  std::uint64_t next_chunk() const { return sizeof(GlbStart) + (std::uint64_t{document.bytes} + 3) / 4 * 4; }
};

}  // namespace vrpipe
