#include "dyxel/base/option.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace dyxel {
namespace {

using ::testing::HasSubstr;

struct SampleOptions {
  int rounds = 3;
  double sigma = 0.5;
  bool fill = true;
  std::string model = "ggx";
  std::vector<std::string> sequence;

  template <class Self, class Field>
  static void Describe(Self& o, Field&& field) {
    field(o.rounds, {.name = "rounds", .min = 1, .max = 10, .help = "rounds of the fit"});
    field(o.sigma, {.name = "noise.sigma", .unit = "m", .min = 0, .max = 1, .help = "noise"});
    field(o.fill, {.name = "fill", .help = "fill holes"});
    field(o.model, {.name = "model", .choices = {"ggx", "phong"}, .help = "the BRDF"});
    field(o.sequence, {.name = "sequence", .help = "which"});
  }
};

std::string MessageOf(const std::function<void()>& f) {
  try {
    f();
  } catch (const Error& e) {
    EXPECT_EQ(e.fault(), Fault::kUsage);
    return e.what();
  }
  return "nothing was thrown";
}

TEST(OptionTable, SetsEachKind) {
  SampleOptions o;
  OptionTable table;
  table.Add("stage", o);
  table.SetAssignment("stage.rounds=5");
  table.SetAssignment("stage.noise.sigma=1");
  table.SetAssignment("stage.fill=false");
  table.SetAssignment("stage.model=phong");
  table.SetAssignment("stage.sequence=[res, res_b]");
  EXPECT_EQ(o.rounds, 5);
  EXPECT_EQ(o.sigma, 1.0);
  EXPECT_FALSE(o.fill);
  EXPECT_EQ(o.model, "phong");
  EXPECT_THAT(o.sequence, ::testing::ElementsAre("res", "res_b"));
  EXPECT_EQ(table.Fingerprint("stage"),
            "rounds=5\nnoise.sigma=1\nfill=false\nmodel=phong\nsequence=[res, res_b]\n");
  EXPECT_EQ(FormatOption(table.rows()[0].default_value), "3");
}

TEST(OptionTable, RefusesByNameWithValueAndRule) {
  SampleOptions o;
  OptionTable table;
  table.Add("stage", o);
  EXPECT_THAT(MessageOf([&] { table.Set("stage.rounds", "11"); }), HasSubstr("[1, 10]"));
  EXPECT_THAT(MessageOf([&] { table.Set("stage.rounds", "3.5"); }), HasSubstr("whole number"));
  EXPECT_THAT(MessageOf([&] { table.Set("stage.noise.sigma", "nan"); }), HasSubstr("[0, 1]"));
  EXPECT_THAT(MessageOf([&] { table.Set("stage.model", "blinn"); }), HasSubstr("ggx, phong"));
  EXPECT_THAT(MessageOf([&] { table.Set("stage.fil", "1"); }), HasSubstr("mean stage.fill?"));
  EXPECT_THAT(MessageOf([&] { table.SetAssignment("stage.fill"); }), HasSubstr("stage.name=value"));
  EXPECT_EQ(o.rounds, 3);
}

TEST(CheckOptions, FindsAFieldOutOfRange) {
  SampleOptions o;
  CheckOptions("stage", o);
  o.rounds = 0;
  EXPECT_THAT(MessageOf([&] { CheckOptions("stage", o); }), HasSubstr("stage.rounds = 0"));
}

}  // namespace
}  // namespace dyxel
