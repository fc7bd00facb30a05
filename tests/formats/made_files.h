#pragma once

#include <cstdint>
#include <cstring>
#include <string>

namespace vrpipe::testing {

/// A file under construction, little-endian.
class MadeFile {
 public:
  template <class T>
  MadeFile& add(T value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    bytes_.append(bytes, sizeof value);
    return *this;
  }
  template <class T, class... Others>
  MadeFile& add(T value, Others... others) {
    return add(value).add(others...);
  }
  MadeFile& text(const std::string& characters) {
    bytes_ += characters;
    return *this;
  }
  /// Zeros up to this size.
  MadeFile& fill(std::size_t size) {
    if (bytes_.size() < size) bytes_.resize(size, '\0');
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

inline std::uint8_t byte(int value) { return static_cast<std::uint8_t>(value); }

}  // namespace vrpipe::testing
