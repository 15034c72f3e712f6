#include "problems/input_text.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "methods/method_spec.h"
#include "problems/input_error.h"
#include "problems/json_schema.h"
#include "problems/scene_file/expression.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// The first line of the InputError that a call throws.
std::string error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    const std::string text = error.what();
    return text.substr(0, text.find('\n'));
  }
  return "no error";
}

std::string json_error(const std::string& text) {
  return error_of([&] { parse_input_json(text, "FILE"); });
}

TEST(InputText, OrdinaryJsonIsReadAsItIs) {
  const std::string text = R"({"a": [1, 2.5, {"b": null}], "c": "ä √ \"", "d": {"a": true}})";
  EXPECT_EQ(parse_input_json(text, "FILE"), json::parse(text));
  EXPECT_EQ(parse_input_json("// comment\n{\"a\": /* one */ 1}", "FILE")["a"], 1);
}

TEST(InputText, AFieldMayNotBeGivenTwice) {
  EXPECT_EQ(json_error(R"({"a": 1, "a": 1})"), "FILE: a: this field is given twice");
  EXPECT_EQ(json_error(R"({"b": [0, {"a": {"c": 1}, "e": 2, "a": 3}]})"), "FILE: b[1].a: this field is given twice");
  EXPECT_EQ(json_error(R"({"a": {"a": 1}, "b": {"a": 1}})"), "no error");
}

TEST(InputText, DeepNestingIsRefused) {
  for (const int depth : {65, 100000}) {
    std::string lists, objects;
    for (int k = 0; k < depth; ++k) {
      lists += "[";
      objects += "{\"a\":";
    }
    EXPECT_NE(json_error(lists).find("nested more than 64 deep"), std::string::npos) << depth;
    EXPECT_NE(json_error(objects).find("FILE: a.a.a.a"), std::string::npos) << depth;
  }
  EXPECT_EQ(json_error(std::string(64, '[') + "1" + std::string(64, ']')), "no error");
}

TEST(InputText, ControlCharactersAreRefused) {
  EXPECT_EQ(json_error(R"({"a": ["x", "\u001b[2J"]})"),
            "FILE: a[1] = \"\\u001b[2J\": control characters are not allowed");
  EXPECT_EQ(json_error(R"({"a": {"b\n": 1}})"), "FILE: a.? = \"b\\n\": control characters are not allowed");
  EXPECT_NE(json_error(R"(["\u009b"])").find("[0] = \"\\u009b\""), std::string::npos);
  EXPECT_NE(json_error("[\"\xff\"]").find("not valid JSON"), std::string::npos);
}

TEST(InputText, NumbersThatAreNoneAreRefused) {
  for (const char* text : {"1e999", "nan", "01", "1.", "+1", "0x10", "", "{", "[1,]"})
    EXPECT_NE(json_error(text).find("FILE: not valid JSON"), std::string::npos) << text;
  EXPECT_LT(json_error("[\"" + std::string(100000, 'x')).size(), 1000) << "the message quotes a part of a long text";
}

TEST(InputText, ADirectoryIsNoFile) {
  const std::string folder = std::filesystem::temp_directory_path();
  EXPECT_EQ(error_of([&] { read_input_text(folder, "scene file"); }),
            "scene file = " + folder + ": it is a directory, a file is required");
  EXPECT_EQ(error_of([] { read_input_text("/nowhere", "scene file"); }), "scene file = /nowhere: cannot be opened");
  EXPECT_EQ(error_of([] { read_input_text("/dev/zero", "scene file"); }),
            "scene file = /dev/zero: at most 256 MB are possible");
}

TEST(JsonSchema, SaysWhereAndWhatIsRequired) {
  const JsonSchema schema = JsonSchema::parse(R"({
    "type": "object", "additionalProperties": false, "required": ["n"],
    "properties": {
      "n": {"type": "integer", "minimum": 1},
      "x": {"type": "array", "minItems": 1, "maxItems": 2, "items": {"$ref": "#/$defs/part"}},
      "kind": {"type": "string", "enum": ["a", "b"]},
      "map": {"type": "object", "additionalProperties": {"type": "number", "exclusiveMinimum": 0, "maximum": 1}},
      "either": {"anyOf": [{"type": "string", "minLength": 1}, {"type": "array", "items": {"type": "string"}}]}
    },
    "$defs": {"part": {"type": ["number", "null"]}}})");
  const auto error = [&](const char* text) { return error_of([&] { schema.check(json::parse(text), "FILE: "); }); };
  EXPECT_EQ(error(R"({"n": 1, "x": [1, null], "kind": "a", "map": {"u": 1}, "either": ["a"]})"), "no error");
  EXPECT_EQ(error("[]"), "FILE:  = array: an object is required");
  EXPECT_EQ(error("{}"), "FILE: n: this field is missing");
  EXPECT_EQ(error(R"({"n": 0})"), "FILE: n = 0: a whole number >= 1 is required");
  EXPECT_EQ(error(R"({"n": 1.5})"), "FILE: n = 1.5: a whole number is required");
  EXPECT_EQ(error(R"({"n": "1"})"), "FILE: n = \"1\": a whole number is required");
  EXPECT_EQ(error(R"({"n": 1, "x": []})"), "FILE: x, number of entries = 0: at least 1 is required");
  EXPECT_EQ(error(R"({"n": 1, "x": [1, 2, 3]})"), "FILE: x, number of entries = 3: at most 2 are possible");
  EXPECT_EQ(error(R"({"n": 1, "x": [1, {}]})"), "FILE: x[1] = object: a number or null is required");
  EXPECT_EQ(error(R"({"n": 1, "kind": "c"})"), "FILE: kind = \"c\": \"a\" or \"b\" is required");
  EXPECT_EQ(error(R"({"n": 1, "map": {"u": 0}})"), "FILE: map.u = 0: a number > 0 and <= 1 is required");
  EXPECT_EQ(error(R"({"n": 1, "either": 1})"), "FILE: either = 1: a text in quotes or a list is required");
  EXPECT_EQ(error(R"({"n": 1, "either": [1]})"), "FILE: either[0] = 1: a text in quotes is required");
  EXPECT_EQ(error(R"({"n": 1, "m": 1})"),
            "field of FILE = 'm': unknown; did you mean n or x? Known: either, kind, map, n, x");
  EXPECT_THROW(JsonSchema::parse(R"({"propertyNames": {}})"), std::logic_error) << "it would not be checked";
}

TEST(Formulas, ThatWouldFillTheMemoryAreRefusedAtTheirColumn) {
  GiNaC::symbol x("x");
  const ExpressionNames names{{{"x", x}}, {}};
  const auto error = [&](const std::string& text) { return error_of([&] { parse_expression(text, names, "f"); }); };
  EXPECT_EQ(error("1e999999999"), "f, column 1: an exponent of ten from -400 to 400 is possible");
  EXPECT_EQ(error("2+1e-999"), "f, column 3: an exponent of ten from -400 to 400 is possible");
  EXPECT_EQ(error("9**9**9**9"), "f, column 5: a power of numbers is too large");
  EXPECT_EQ(error("x+(2*x)**999999999"),
            "f, column 8: exponents up to 1000 are possible, those of powers of powers multiply");
  EXPECT_EQ(error("((2*x)**1000)**1000"),
            "f, column 14: exponents up to 1000 are possible, those of powers of powers multiply");
  EXPECT_EQ(error("(2*sin(1))**1e6"),
            "f, column 11: exponents up to 1000 are possible, those of powers of powers multiply");
  EXPECT_EQ(error("x+1e300*1e300"), "f, column 8: a number is beyond the range of double precision");
  EXPECT_EQ(error("1.0000001**1000000000"), "f, column 10: a power of numbers is too large");
  EXPECT_EQ(error(std::string(500, '1')), "f, column 1: a number may have 400 digits");
  EXPECT_EQ(error(std::string(200000, '1')), "f = 200000 characters: at most 100000 are possible");
  EXPECT_EQ(error("x+sqrt(-1)"), "f, column 3: a real number is required");
  std::string nested = "x";
  for (int k = 0; k < 60; ++k) nested = "min(" + nested + ", " + std::to_string(k) + ")";
  EXPECT_NE(error(nested).find("the expression is too large"), std::string::npos);
  for (const char* text : {"1.000001**3600", "x**1000", "2**0.5", "1e300*1e90", "min(min(x, 1), 2)", "(x+1)**-3"})
    EXPECT_EQ(error(text), "no error") << text;
}

TEST(Formulas, ErrorsInLongOnesShowWhatIsAroundThem) {
  const std::string text = std::string(5000, ' ') + "1+y" + std::string(5000, ' ');
  try {
    parse_expression(text, {}, "f");
    FAIL();
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("f, column 5003: unknown name 'y'"), std::string::npos);
    EXPECT_LT(message.size(), 400);
    const auto lines = message.find('\n');
    const std::string picture = message.substr(lines + 1);
    EXPECT_EQ(picture.find('^') - picture.find('\n') - 1, picture.find('y')) << message;
  }
}

TEST(MethodSpec, AnOptionMayNotBeGivenTwice) {
  EXPECT_EQ(error_of([] { MethodSpec("fesd:gauss:3,n_fe=1,n_fe=2"); }),
            "method option = 'n_fe=2': n_fe is given twice");
  EXPECT_EQ(error_of([] { MethodSpec("fesd:gauss:3,n_fe=1,elements=fixed"); }), "no error");
}

}  // namespace
}  // namespace ricochet
