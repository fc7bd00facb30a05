#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "formats/file_bytes.h"

namespace vrpipe {

/// Unpacks a gzip stream step by step, so that a header in it can be read before memory is given to what it announces.
class GzipStream {
 public:
  /// @throws UserError when there is not enough memory
  explicit GzipStream(const FileBytes& packed);
  ~GzipStream();
  GzipStream(const GzipStream&) = delete;
  GzipStream& operator=(const GzipStream&) = delete;

  /// The next `size` bytes, on top of those unpacked so far. Memory grows with what is really there.
  /// @throws UserError that names the byte of the packed file when it ends before or is damaged
  void unpack(std::uint64_t size);
  /// What is left up to the end, on top of those unpacked so far, of at most 16 MB.
  /// @throws UserError when it ends before, is damaged or goes on for longer
  void unpack_rest();
  /// Unpacks what is left and drops it: only at its end has a stream its checksum.
  /// @throws UserError when it ends before, is damaged, or goes on much longer than what was unpacked
  void finish();
  /// A copy of the first `size` bytes unpacked. Messages about it name its own bytes, not those of the file.
  FileBytes first(std::uint64_t size) const;
  /// All that was unpacked.
  FileBytes take();

 private:
  struct State;
  int step();
  /// Gives what is left to `take`, up to the end.
  void read_on(const std::function<void(const std::byte* bytes, std::size_t size)>& take);
  std::unique_ptr<State> state_;
};

/// Unpacks the Zstandard frame in `size` bytes of `packed` from `offset` on, which holds `unpacked_size` bytes.
/// @throws UserError when it is damaged or holds another number of bytes
FileBytes unpack_zstd(const FileBytes& packed, std::uint64_t offset, std::uint64_t size, std::uint64_t unpacked_size,
                      const std::string& what);

/// A decoded image, 4 bytes a pixel: red, green, blue, alpha.
struct RgbaImage {
  FileBytes pixels;
  std::uint64_t width = 0, height = 0;  ///< pixels
  const std::byte* operator[](std::uint64_t pixel) const { return pixels.data() + 4 * pixel; }
};

/// Decodes a lossless WebP image, or a .png of 8 bits a channel, whose values are taken as they are, whatever it says of gamma.
/// @throws UserError when it is neither, is damaged, or has fewer than `least` or more than `most` pixels
RgbaImage unpack_image(const FileBytes& packed, std::uint64_t least, std::uint64_t most);

}  // namespace vrpipe
