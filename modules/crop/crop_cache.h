#pragma once

#include <cstdint>
#include <vector>

namespace vrpipe {

/// The colour cache: sectored lines, fully associative, least recently used goes. Tags only; data stays in the surface.
/// Fully associative since a real GPU's holds its whole size in any shape of rectangles (measured, paper 7.1).
class CropCache {
 public:
  using Line = std::uint32_t;
  static constexpr Line no_line = ~0U;

  CropCache(std::uint32_t cache_bytes, std::uint32_t line_bytes, std::uint32_t sector_bytes,
            std::uint64_t surface_bytes);

  std::uint32_t line_bytes() const { return line_bytes_; }
  std::uint32_t sector_bytes() const { return sector_bytes_; }

  /// The line that holds the address, made most recently used; `no_line` when none does.
  Line find(std::uint64_t address);
  /// Whether a line can be had for another address: one is free, or the least recently used ones are not pinned.
  bool can_allocate() const;
  /// Takes a line for the address. `evicted_dirty` gets the dirty sectors, a bit each, of the line that went, and
  /// `evicted_address` its byte address.
  Line allocate(std::uint64_t address, unsigned& evicted_dirty, std::uint64_t& evicted_address);

  void pin(Line line) { ++lines_[line].pins; }
  void unpin(Line line) { --lines_[line].pins; }
  bool has_sector(Line line, unsigned sector) const { return ((lines_[line].present >> sector) & 1U) != 0; }
  void add_sector(Line line, unsigned sector) { lines_[line].present |= 1U << sector; }
  void dirty_sector(Line line, unsigned sector) { lines_[line].dirty |= 1U << sector; }
  /// Bytes of all lines in use.
  std::uint64_t occupied_bytes() const { return std::uint64_t{used_} * line_bytes_; }

 private:
  struct Entry {
    std::uint64_t tag = 0;
    std::uint32_t present = 0;
    std::uint32_t dirty = 0;
    std::uint32_t pins = 0;
    Line newer = no_line;
    Line older = no_line;
  };
  void unlink(Line line);
  void make_newest(Line line);
  Line victim() const;

  std::uint32_t line_bytes_;
  std::uint32_t sector_bytes_;
  std::uint32_t used_ = 0;
  Line newest_ = no_line;
  Line oldest_ = no_line;
  std::vector<Entry> lines_;
  std::vector<Line> line_of_tag_;
};

}  // namespace vrpipe
