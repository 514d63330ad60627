#include "dyxel/pipeline/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/atomic_file.h"

namespace dyxel {
namespace {

using ::testing::HasSubstr;

// What reading `text` as dyxel.toml is refused with.
std::string Refusal(const std::string& text) {
  PipelineOptions options;
  try {
    ReadTomlOptions(text, "dyxel.toml", options);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(TomlOptions, ComeBackAsTheyWereWritten) {
  PipelineOptions options;
  OptionTable table = options.Table();
  table.Set("motion.max_iterations", "7");
  table.Set("textures.grazing", "0.125");
  table.Set("reflectance.sequence", "[res, res_b]");
  PipelineOptions read;
  ReadTomlOptions(WriteTomlOptions(options), "dyxel.toml", read);
  EXPECT_EQ(WriteTomlOptions(read), WriteTomlOptions(options));
  EXPECT_EQ(read.motion.max_iterations, 7);
  EXPECT_EQ(read.textures.grazing, 0.125);
  EXPECT_THAT(read.reflectance_sequence.sequence, ::testing::ElementsAre("res", "res_b"));
}

TEST(TomlOptions, RefuseWithTheFileAndTheRule) {
  EXPECT_THAT(Refusal("[motion]\nmax_iteration = 7\n"),
              AllOf(HasSubstr("dyxel.toml"), HasSubstr("Did you mean motion.max_iterations")));
  EXPECT_THAT(Refusal("[motion]\nmax_iterations = 0\n"), HasSubstr("must be in [1, 500]"));
  EXPECT_THAT(Refusal("[motion]\nmax_iterations = \"7\"\n"), HasSubstr("wrong kind"));
  EXPECT_THAT(Refusal("scale = 1\n"), HasSubstr("outside a [stage] table"));
  EXPECT_THAT(Refusal("[motion\n"), HasSubstr("line 1"));
}

TEST(Options, ThePageOfTheDocsIsWhatIsPrinted) {
  EXPECT_EQ(ReadFile(DYXEL_OPTIONS_PAGE), OptionTableMarkdown())
      << "dyxel options --markdown > docs/options.md";
}

}  // namespace
}  // namespace dyxel
