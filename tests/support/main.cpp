#include <cstdlib>

#include <gtest/gtest.h>

// SystemC's library has a main of its own, which would win over the one in an archive.
int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  setenv("SYSTEMC_DISABLE_COPYRIGHT_MESSAGE", "1", 1);
  return RUN_ALL_TESTS();
}
