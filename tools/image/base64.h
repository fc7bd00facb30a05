#pragma once

#include <string>

namespace vrpipe::tools {

/// Bytes as text (RFC 4648), for pages that hold their images.
std::string base64(const std::string& bytes);
/// Undoes it; what is no digit is passed over.
std::string bytes_of_base64(const std::string& text);

}  // namespace vrpipe::tools
