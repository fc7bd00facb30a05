#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>

namespace vrpipe {
namespace {

TEST(Printable, OrdinaryTextStaysAsItIs) {
  for (const std::string text : {"", "tc.bins=64", "C:\\scenes\\a.ply", "caf\u00e9 \u20ac \U0001F600"}) {
    EXPECT_EQ(printable(text), text);
    EXPECT_EQ(valid_utf8(text), text);
  }
}

TEST(Printable, ControlCharactersAreEscapedForTerminalsOnly) {
  const std::string text("a\0b\x1b[2J\a\n\t\r\x7f\u009b", 14);
  EXPECT_EQ(printable(text), "a\\x00b\\x1B[2J\\x07\\n\\t\\r\\x7F\\xC2\\x9B");
  EXPECT_EQ(valid_utf8(text), text);
}

TEST(Printable, BytesThatAreNotUtf8AreEscaped) {
  // A lone byte of Latin-1, cut sequences, too long forms, a surrogate, beyond U+10FFFF, bytes that never occur.
  EXPECT_EQ(valid_utf8("caf\xe9.ply"), "caf\\xE9.ply");
  EXPECT_EQ(valid_utf8("\xe2\x82"), "\\xE2\\x82");
  EXPECT_EQ(valid_utf8("\xf0\x9f\x98."), "\\xF0\\x9F\\x98.");
  EXPECT_EQ(valid_utf8("\xc0\xaf\xe0\x80\xaf\xf0\x80\x80\xaf"), "\\xC0\\xAF\\xE0\\x80\\xAF\\xF0\\x80\\x80\\xAF");
  EXPECT_EQ(valid_utf8("\xed\xa0\x80"), "\\xED\\xA0\\x80");
  EXPECT_EQ(valid_utf8("\xf4\x90\x80\x80\xff"), "\\xF4\\x90\\x80\\x80\\xFF");
  EXPECT_EQ(printable("\x80"), "\\x80");
}

TEST(Printable, IsItsOwnEscape) {
  const std::string once = printable("\xe9\n\x1b");
  EXPECT_EQ(printable(once), once);
}

TEST(Printable, AMistakeOfTheUserIsOnePrintableLineToItsEnd) {
  const UserError error("bad\x1b", std::string("a\0b", 3), "two\nlines", "mend \xff");
  EXPECT_STREQ(error.what(), "bad\\x1B (a\\x00b): two\\nlines; mend \\xFF");
}

}  // namespace
}  // namespace vrpipe
