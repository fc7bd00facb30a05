#include <vrpipe/component/printable.h>

#include <cstddef>

#include <fmt/format.h>

namespace vrpipe {
namespace {

unsigned char byte_at(const std::string& text, std::size_t at) {
  return at < text.size() ? static_cast<unsigned char>(text[at]) : static_cast<unsigned char>(0);
}

bool in(unsigned char byte, unsigned low, unsigned high) { return byte >= low && byte <= high; }

/// Bytes of the well-formed sequence at `at` (table 3-7 of the Unicode standard); 0 when there is none.
std::size_t sequence_length(const std::string& text, std::size_t at) {
  const unsigned char first = byte_at(text, at);
  const unsigned char second = byte_at(text, at + 1);
  if (first < 0x80) return 1;
  if (in(first, 0xC2, 0xDF)) return in(second, 0x80, 0xBF) ? 2 : 0;
  const bool third_follows = in(byte_at(text, at + 2), 0x80, 0xBF);
  if (in(first, 0xE0, 0xEF)) {
    // Neither too long a form nor a surrogate.
    const bool second_follows = in(second, first == 0xE0 ? 0xA0 : 0x80, first == 0xED ? 0x9F : 0xBF);
    return second_follows && third_follows ? 3 : 0;
  }
  if (in(first, 0xF0, 0xF4)) {
    const bool second_follows = in(second, first == 0xF0 ? 0x90 : 0x80, first == 0xF4 ? 0x8F : 0xBF);
    return second_follows && third_follows && in(byte_at(text, at + 3), 0x80, 0xBF) ? 4 : 0;
  }
  return 0;
}

std::string escaped(char c) {
  switch (c) {
    case '\n': return "\\n";
    case '\t': return "\\t";
    case '\r': return "\\r";
    default: return fmt::format("\\x{:02X}", static_cast<unsigned char>(c));
  }
}

/// C0, DEL, and C1, which is U+0080 to U+009F.
bool is_control(const std::string& text, std::size_t at) {
  const unsigned char first = byte_at(text, at);
  return first < 0x20 || first == 0x7F || (first == 0xC2 && in(byte_at(text, at + 1), 0x80, 0x9F));
}

template <class Spare>
std::string escape(const std::string& text, const Spare& is_spared) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = sequence_length(text, at);
    if (length > 0 && is_spared(at)) {
      result.append(text, at, length);
      at += length;
    } else {
      result += escaped(text[at++]);
    }
  }
  return result;
}

}  // namespace

std::string valid_utf8(const std::string& text) {
  return escape(text, [](std::size_t) { return true; });
}

std::string printable(const std::string& text) {
  return escape(text, [&text](std::size_t at) { return !is_control(text, at); });
}

}  // namespace vrpipe
