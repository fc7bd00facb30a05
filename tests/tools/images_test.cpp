#include "tool_test_support.h"

#include <cmath>
#include <limits>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <png.h>

#include <vrpipe/platforms/simulation.h>

#include "image/images.h"

namespace vrpipe::testing {
namespace {

struct Png {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Read with libpng's simple interface, which knows nothing of how the file was written.
Png read_png(const std::filesystem::path& path) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  Png png;
  if (png_image_begin_read_from_file(&image, path.c_str()) == 0) {
    ADD_FAILURE() << path << ": " << image.message;
    return png;
  }
  EXPECT_EQ(image.format & PNG_FORMAT_FLAG_ALPHA, 0U);
  image.format = PNG_FORMAT_RGB;
  png.width = image.width;
  png.height = image.height;
  png.rgb.resize(PNG_IMAGE_SIZE(image));
  EXPECT_NE(png_image_finish_read(&image, nullptr, png.rgb.data(), 0, nullptr), 0) << image.message;
  return png;
}

struct Exr {
  int width = 0, height = 0;
  std::vector<float> rgba;
};

Exr read_exr(const std::filesystem::path& path) {
  Imf::InputFile file(path.c_str());
  const auto window = file.header().dataWindow();
  Exr exr;
  exr.width = window.max.x - window.min.x + 1;
  exr.height = window.max.y - window.min.y + 1;
  exr.rgba.resize(std::size_t{4} * static_cast<std::size_t>(exr.width) * static_cast<std::size_t>(exr.height));
  Imf::FrameBuffer pixels;
  std::size_t offset = 0;
  for (const char* channel : {"R", "G", "B", "A"}) {
    const Imf::Channel* const found = file.header().channels().findChannel(channel);
    EXPECT_TRUE(found != nullptr && found->type == Imf::FLOAT) << channel;
    pixels.insert(channel, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(exr.rgba.data() + offset++), 16,
                                      16 * static_cast<std::size_t>(exr.width)));
  }
  file.setFrameBuffer(pixels);
  file.readPixels(window.min.y, window.max.y);
  return exr;
}

class Images : public ToolTest {};

TEST_F(Images, PngIsOverTheBackgroundClampedAndRoundedToNearest) {
  tools::SharedImage image(3, 2);
  const std::vector<float> pixels{0,
                                  0,
                                  0,
                                  0,  // all background
                                  0.5F,
                                  0.25F,
                                  0,
                                  1,  // all image
                                  0.2F,
                                  0.1F,
                                  0.05F,
                                  0.5F,  // half of each
                                  2,
                                  -1,
                                  std::numeric_limits<float>::quiet_NaN(),
                                  1,  // clamped; NaN is black
                                  std::numeric_limits<float>::infinity(),
                                  100.4F / 255,
                                  100.6F / 255,
                                  1,  //
                                  1,
                                  1,
                                  1,
                                  1};
  std::copy(pixels.begin(), pixels.end(), image.values());
  const Png png = read_png(write("image.png", tools::encode_png(image, {1.0F, 0.5F, 0.0F})));
  EXPECT_EQ(png.width, 3U);
  EXPECT_EQ(png.height, 2U);
  const std::vector<std::uint8_t> expected{255, 128, 0, 128, 64,  0,   179, 89,  13,
                                           255, 0,   0, 255, 100, 101, 255, 255, 255};
  EXPECT_EQ(png.rgb, expected);
}

TEST_F(Images, ExrKeepsEveryBit) {
  tools::SharedImage image(5, 3);
  for (std::size_t i = 0; i < 60; ++i)
    image.values()[i] = std::ldexp(1.0F + static_cast<float>(i) / 64, 7 - static_cast<int>(i));
  const Exr exr = read_exr(write("image.exr", tools::encode_exr(image)));
  ASSERT_EQ(exr.width, 5);
  ASSERT_EQ(exr.height, 3);
  EXPECT_TRUE(std::equal(exr.rgba.begin(), exr.rgba.end(), image.values()));
}

TEST_F(Images, CompareWritesFourPairsThatTheJsonNames) {
  const nlohmann::json result =
      json_of({"compare", "--scene", "tiny.spl", "--output", "images", "--background", "0.25,0.5,1"});
  const Draw draw = tiny_draw();
  for (std::size_t i = 0; i < 4; ++i) {
    const nlohmann::json& run = result["runs"][i];
    const std::string variant = run["variant"];
    EXPECT_EQ(run["images"]["png"], "images/tiny-" + variant + ".png");
    EXPECT_EQ(run["images"]["exr"], "images/tiny-" + variant + ".exr");
    const Exr exr = read_exr(folder() / run["images"]["exr"].get<std::string>());
    const Png png = read_png(folder() / run["images"]["png"].get<std::string>());
    ASSERT_EQ(exr.width, 48);
    ASSERT_EQ(exr.height, 40);
    ASSERT_EQ(png.width, 48U);

    RunRequest request;
    request.platform = &platforms().front();
    request.variant = variant_named(variant);
    fresh_simulation();
    const RunResult expected = simulate(request, draw);
    EXPECT_EQ(run["result_hash"], expected.result_hash);
    std::size_t wrong = 0;
    const float background[] = {0.25F, 0.5F, 1.0F};
    for (std::uint32_t y = 0; y < 40; ++y) {
      for (std::uint32_t x = 0; x < 48; ++x) {
        const std::array<float, 4> pixel = expected.framebuffer.color.pixel(x, y);
        const std::size_t place = std::size_t{y} * 48 + x;
        wrong += !std::equal(pixel.begin(), pixel.end(), &exr.rgba[4 * place]);
        for (std::size_t channel = 0; channel < 3; ++channel) {
          const float value = std::min(1.0F, pixel[channel] + (1 - pixel[3]) * background[channel]);
          wrong += std::fabs(static_cast<float>(png.rgb[3 * place + channel]) - 255 * value) > 0.501F;
        }
      }
    }
    EXPECT_EQ(wrong, 0U) << variant;
  }
  EXPECT_EQ(files().size(), 10U);  // tiny.spl, the folder, eight images: nothing temporary is left
}

TEST_F(Images, AreNamedAfterTheBuiltInScene) {
  const Finished finished =
      vrpipe({"run", "--size", "16x16", "--fidelity", "functional", "--variant", "het", "--output", "images"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(files(),
            (std::vector<std::string>{"images", "images/object-het.exr", "images/object-het.png", "tiny.spl"}));
}

}  // namespace
}  // namespace vrpipe::testing
