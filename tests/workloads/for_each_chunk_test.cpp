#include "for_each_chunk.h"

#include <gtest/gtest.h>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>

namespace vrpipe {
namespace {

TEST(ForEachChunk, EveryChunkIsDoneOnce) {
  for (const unsigned threads : {1U, 2U, 7U}) {
    std::vector<std::atomic<int>> times(100);
    for_each_chunk(times.size(), threads, [&](std::uint64_t chunk) { ++times[chunk]; });
    for (const std::atomic<int>& count : times) EXPECT_EQ(count, 1) << threads;
  }
}

TEST(ForEachChunk, WhatAChunkThrowsOnAnyThreadReachesTheCaller) {
  for (const unsigned threads : {1U, 3U}) {
    std::atomic<unsigned> begun{0};
    const auto fail = [&](std::uint64_t) {
      ++begun;
      throw std::runtime_error("no memory");
    };
    EXPECT_THROW(for_each_chunk(1000, threads, fail), std::runtime_error);
    EXPECT_LE(begun, threads);
  }
}

#ifndef VRPIPE_SANITIZED  // by what needs all addresses there are
TEST(ForEachChunk, WithoutMoreThreadsTheCallerDoesTheWork) {
  const pid_t child = ::fork();
  if (child == 0) {
    // Less than the stack of a thread.
    const rlimit limit{4096, 4096};
    ::setrlimit(RLIMIT_AS, &limit);
    unsigned done = 0;
    try {
      for_each_chunk(8, 4, [&](std::uint64_t) { ++done; });
    } catch (...) {
      ::_exit(100);
    }
    ::_exit(static_cast<int>(done));
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status)) << WTERMSIG(status);
  EXPECT_EQ(WEXITSTATUS(status), 8);
}
#endif

}  // namespace
}  // namespace vrpipe
