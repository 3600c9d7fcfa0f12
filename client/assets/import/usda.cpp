#include "client/assets/import/usda.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "client/assets/import/parse_text.hpp"
#include "core/shown_text.hpp"

namespace hairnet::usda {
namespace {

// The most prims and statements of a file together.
constexpr std::size_t kStatementsMax = 500'000;

// Whether the character may be part of a name, a type or a number. Bytes of UTF-8 beyond ASCII may.
bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == ':' ||
         c == '.' || c == '-' || c == '+' || static_cast<unsigned char>(c) >= 0x80;
}

// A place in the text, from which values are read one after the other. After an error all values are empty.
class Cursor {
 public:
  explicit Cursor(std::string_view text) : text_(text) {}

  [[nodiscard]] bool failed() const { return !error_.empty(); }
  [[nodiscard]] bool at_end() const { return at_ >= text_.size(); }
  [[nodiscard]] char peek() const { return at_end() ? '\0' : text_[at_]; }
  [[nodiscard]] std::string error() const {
    const auto line = 1 + std::ranges::count(text_.substr(0, at_), '\n');
    return "line " + std::to_string(line) + ": " + error_;
  }
  void fail(std::string error) {
    if (!failed()) error_ = std::move(error);
  }
  // The rest of the line, for messages.
  [[nodiscard]] std::string next_word() const {
    return at_end() ? "the file's end" : shown(text_.substr(at_, text_.find_first_of("\r\n", at_) - at_));
  }

  // Skips blanks, line ends and comments, and the semicolons and commas between statements.
  void skip_blanks() {
    for (; !at_end(); ++at_) {
      const char c = text_[at_];
      if (c == '#' || text_.substr(at_, 2) == "//") {
        at_ = std::min(text_.find('\n', at_), text_.size());
        if (at_end()) return;
      } else if (text_.substr(at_, 2) == "/*") {
        const std::size_t end = text_.find("*/", at_ + 2);
        if (end == std::string_view::npos) return fail("a comment without an end");
        // The loop's own step passes the second character of the mark.
        at_ = end + 1;
      } else if (c != ' ' && c != '\t' && c != '\r' && c != '\n' && c != ';' && c != ',') {
        return;
      }
    }
  }

  // Takes the character if it comes next, after blanks. Returns whether it did.
  bool take(char c) {
    skip_blanks();
    if (failed() || peek() != c) return false;
    ++at_;
    return true;
  }

  // Takes a name or a type, with the brackets of a list type such as float[]; empty if none stands here.
  std::string_view word() {
    skip_blanks();
    const std::size_t begin = at_;
    while (!at_end() && is_word(text_[at_])) ++at_;
    if (text_.substr(at_, 2) == "[]" && at_ > begin) at_ += 2;
    return failed() ? std::string_view{} : text_.substr(begin, at_ - begin);
  }

  // Returns the text before the next `c` in this line; empty if the line has none. The time of a sample is read so,
  // since a colon is part of words elsewhere.
  std::string_view until(char c) {
    skip_blanks();
    const std::size_t begin = at_, end = text_.find_first_of(std::string{c, '\n'}, at_);
    if (failed() || end == std::string_view::npos || text_[end] != c) return {};
    at_ = end + 1;
    return text_.substr(begin, end - begin);
  }

  // A string, with its quotes.
  std::string_view quoted() {
    skip_blanks();
    const std::size_t begin = at_;
    if (peek() != '"' && peek() != '\'') fail("expected a name in quotes, not " + next_word());
    if (failed()) return {};
    skip_string();
    return failed() ? std::string_view{} : text_.substr(begin, at_ - begin);
  }

  // Returns a value of any type. In metadata the value may also be a file with a prim in it, and with a shift of its
  // times.
  std::string_view value(bool is_metadata) {
    skip_blanks();
    const std::size_t begin = at_;
    if (!skip_atom()) fail("expected a value, not " + next_word());
    const std::size_t end = at_;
    if (failed()) return {};
    if (!is_metadata || (text_[begin] != '@' && text_[begin] != '<')) return text_.substr(begin, end - begin);
    std::size_t last = end;
    skip_blanks();
    if (text_[begin] == '@' && peek() == '<') {
      skip_atom();
      last = at_;
      skip_blanks();
    }
    if (peek() == '(') {
      skip_atom();
      last = at_;
    }
    at_ = last;
    return failed() ? std::string_view{} : text_.substr(begin, last - begin);
  }

  // What stands between the brackets that begin here.
  std::string_view inside_brackets() {
    const std::size_t begin = at_;
    skip_brackets();
    // Both brackets are left out.
    return failed() ? std::string_view{} : text_.substr(begin + 1, at_ - begin - 2);
  }

 private:
  // Passes one value: a number or word, a string, a list, a file's name or a path. Returns whether there was one.
  bool skip_atom() {
    const std::size_t begin = at_;
    switch (peek()) {
      case '[':
      case '(':
      case '{':
        skip_brackets();
        break;
      case '"':
      case '\'':
        skip_string();
        break;
      case '@':
        skip_asset();
        break;
      case '<':
        skip_path();
        break;
      default:
        while (!at_end() && is_word(text_[at_])) ++at_;
    }
    return at_ > begin;
  }

  void skip_string() {
    const char quote = text_[at_];
    const std::size_t begin = at_;
    const bool is_long = at_ + 2 < text_.size() && text_[at_ + 1] == quote && text_[at_ + 2] == quote;
    for (at_ += is_long ? 3 : 1; !at_end(); ++at_) {
      if (text_[at_] == '\\') {
        ++at_;
      } else if (text_[at_] == '\n' && !is_long) {
        break;
      } else if (text_[at_] == quote &&
                 (!is_long || text_.substr(at_, 3) == std::string_view(text_.data() + begin, 3))) {
        at_ += is_long ? 3 : 1;
        return;
      }
    }
    at_ = begin;
    fail("a string without an end");
  }

  void skip_asset() {
    const bool is_long = text_.substr(at_, 3) == "@@@";
    const std::string_view mark = is_long ? "@@@" : "@";
    const std::size_t end = text_.find(mark, at_ + mark.size());
    if (end == std::string_view::npos) return fail("a file's name without an end");
    at_ = end + mark.size();
    // The name may end with an @ of its own.
    while (is_long && peek() == '@') ++at_;
  }

  void skip_path() {
    const std::size_t end = text_.find('>', at_);
    if (end == std::string_view::npos) return fail("a path without an end");
    at_ = end + 1;
  }

  // Passes everything up to the bracket that closes the one here, with strings and comments, whose brackets do not
  // count.
  void skip_brackets() {
    const std::size_t begin = at_;
    std::string open;
    for (; !at_end(); ++at_) {
      const char c = text_[at_];
      // Numbers and blanks are most of a file, so they are passed first.
      if ((c >= '0' && c <= '9') || c == ' ' || c == ',' || c == '.' || c == '-') continue;
      if (c == '(' || c == '[' || c == '{') {
        open.push_back(c);
        if (open.size() > kDepthMax) return fail("brackets nested deeper than " + std::to_string(kDepthMax));
      } else if (c == ')' || c == ']' || c == '}') {
        if (open.back() != (c == ')' ? '(' : c == ']' ? '[' : '{')) break;
        open.pop_back();
        if (open.empty()) {
          ++at_;
          return;
        }
      } else if (c == '#' || c == '"' || c == '\'' || c == '@' || c == '<' || c == '/') {
        const std::size_t before = at_;
        if (c == '#' || c == '/') {
          skip_blanks();
        } else {
          skip_atom();
        }
        if (failed()) return;
        // The step of the loop follows, and the character behind must not be lost.
        if (at_ > before) --at_;
      }
    }
    at_ = begin;
    fail(std::string("no end of the brackets that begin with ") + text_[begin]);
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::string error_;
};

// Reads the statements of a file one after the other. `open` is where they belong.
class Parser {
 public:
  explicit Parser(std::string_view text) : in_(text) {}

  Result<Layer> parse() {
    layer_.prims.emplace_back();
    open_.push_back({Frame::Kind::prim, 0, {}});
    in_.skip_blanks();
    if (in_.peek() == '(') layer_.prims[0].metadata = in_.inside_brackets();
    while (!in_.failed()) {
      in_.skip_blanks();
      if (in_.failed() || in_.at_end()) break;
      // Closing brackets end a prim or its variants; what they hold has gone to `layer_` by then.
      if (in_.take('}')) {
        if (open_.size() == 1) {
          in_.fail("a } without its {");
        } else {
          open_.pop_back();
        }
      } else if (open_.back().kind == Frame::Kind::variants) {
        read_variant();
      } else {
        read_statement();
      }
      if (open_.size() > kDepthMax) in_.fail("prims nested deeper than " + std::to_string(kDepthMax));
      if (statement_count_ + layer_.prims.size() > kStatementsMax)
        in_.fail("more than " + std::to_string(kStatementsMax) + " prims and attributes");
    }
    if (!in_.failed() && open_.size() > 1)
      in_.fail("truncated: the file ends inside " + shown(layer_.prims[open_.back().prim].name));
    if (in_.failed()) return Refusal(in_.error());
    return std::move(layer_);
  }

 private:
  struct Frame {
    enum class Kind : std::uint8_t { prim, variants } kind;
    std::size_t prim;
    // The name of the variant that the prim selects; empty: none.
    std::string selected;
  };

  void expect(char c) {
    if (!in_.take(c)) in_.fail(std::string("expected ") + c + ", not " + in_.next_word());
  }

  void read_statement() {
    std::string_view word = in_.word();
    if (word == "def" || word == "over" || word == "class") return read_prim(word);
    if (word == "variantSet") return open_variants();
    while (word == "prepend" || word == "append" || word == "delete" || word == "add" || word == "reorder" ||
           word == "custom" || word == "uniform" || word == "varying" || word == "config")
      word = in_.word();
    if (word.empty()) return in_.fail("expected a prim or an attribute, not " + in_.next_word());
    read_property(word);
  }

  void read_prim(std::string_view specifier) {
    Prim prim;
    prim.parent = open_.back().prim;
    prim.specifier = specifier;
    in_.skip_blanks();
    if (in_.peek() != '"' && in_.peek() != '\'') prim.type = in_.word();
    prim.name = in_.quoted();
    if (prim.name.size() >= 2) prim.name = prim.name.substr(1, prim.name.size() - 2);
    in_.skip_blanks();
    if (in_.peek() == '(') prim.metadata = in_.inside_brackets();
    expect('{');
    if (in_.failed()) return;
    // A variant may say more about a prim that is there.
    const auto [known, is_new] = named_.try_emplace({prim.parent, prim.name}, layer_.prims.size());
    if (is_new) {
      layer_.prims.push_back(prim);
    } else {
      Prim& same = layer_.prims[known->second];
      // `over` only adds to a prim, so a later `def` replaces the specifier.
      if (same.specifier == "over") same.specifier = prim.specifier;
      if (same.type.empty()) same.type = prim.type;
      if (same.metadata.empty()) same.metadata = prim.metadata;
    }
    open_.push_back({Frame::Kind::prim, known->second, {}});
  }

  void open_variants() {
    const std::size_t prim = open_.back().prim;
    const std::string name = unquoted(in_.quoted());
    expect('=');
    expect('{');
    std::string selected;
    // The metadata has the selection, such as `variants = { string style = "long" }`.
    const std::string_view choices = field(layer_.prims[prim].metadata, "variants");
    if (choices.size() >= 2) selected = unquoted(field(choices.substr(1, choices.size() - 2), name));
    open_.push_back({Frame::Kind::variants, prim, std::move(selected)});
  }

  // A variant that is not selected is skipped by its brackets, and named if it seems to hold curves.
  void read_variant() {
    const std::string name = unquoted(in_.quoted());
    in_.skip_blanks();
    if (in_.peek() == '(') in_.inside_brackets();
    in_.skip_blanks();
    if (in_.failed()) return;
    if (in_.peek() != '{') return in_.fail("expected {, not " + in_.next_word());
    if (name == open_.back().selected && !name.empty()) {
      expect('{');
      open_.push_back({Frame::Kind::prim, open_.back().prim, {}});
    } else if (in_.inside_brackets().find("Curves") != std::string_view::npos) {
      layer_.skipped_variants.push_back(name);
    }
  }

  // "point3f[] points = [...] (...)", "rel material:binding = <...>", "float radius.timeSamples = {...}"
  void read_property(std::string_view type) {
    Statement statement;
    statement.type = type;
    statement.name = in_.word();
    std::string_view suffix;
    if (const std::size_t dot = statement.name.rfind('.'); dot != std::string_view::npos) {
      suffix = statement.name.substr(dot + 1);
      statement.name = statement.name.substr(0, dot);
    }
    if (in_.take('=')) {
      if (suffix == "timeSamples") {
        read_samples(statement);
      } else if (const std::string_view value = in_.value(false); suffix.empty() && value != "None") {
        statement.value = value;
      }
    }
    in_.skip_blanks();
    if (in_.peek() == '(') statement.metadata = in_.inside_brackets();
    ++statement_count_;
    layer_.prims[open_.back().prim].statements.push_back(std::move(statement));
  }

  // Samples without a value (None) are left out.
  void read_samples(Statement& statement) {
    expect('{');
    while (!in_.failed() && !in_.take('}')) {
      std::string_view time = in_.until(':');
      const std::optional<double> number = parse_number<double>(take_word(time));
      if (!number || !take_word(time).empty())
        return in_.fail("expected the time of a sample and a colon before " + in_.next_word());
      const std::string_view value = in_.value(false);
      if (value != "None") statement.samples.push_back({*number, value});
    }
  }

  Cursor in_;
  Layer layer_;
  // The prims and sets of variants whose closing bracket has not come yet, the innermost last.
  std::vector<Frame> open_;
  // The prims by their parent and name, since a prim may be described several times.
  std::map<std::pair<std::size_t, std::string_view>, std::size_t> named_;
  // The attributes and relations of all prims so far.
  std::size_t statement_count_ = 0;
};

// Calls `take` with each word and each bracket between commas, blanks and comments, until it returns false.
template <class Take>
bool each_word(std::string_view value, Take take) {
  constexpr auto is_edge = [](char c) { return c == '(' || c == ')' || c == '[' || c == ']'; };
  constexpr auto is_between = [](char c) { return c == ' ' || c == ',' || c == '\n' || c == '\t' || c == '\r'; };
  for (std::size_t at = 0; at < value.size();) {
    if (is_between(value[at])) {
      ++at;
    } else if (is_edge(value[at])) {
      if (!take(value.substr(at++, 1))) return false;
    } else if (value[at] == '#') {
      at = std::min(value.find('\n', at), value.size());
    } else {
      const std::size_t begin = at;
      while (at < value.size() && !is_between(value[at]) && !is_edge(value[at]) && value[at] != '#') ++at;
      if (!take(value.substr(begin, at - begin))) return false;
    }
  }
  return true;
}

bool is_bracket(std::string_view word) {
  return word == "(" || word == ")" || word == "[" || word == "]";
}

std::optional<double> real(std::string_view word) {
  const std::optional<double> number = parse_decimal(word);
  if (number) return number;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (word == "inf" || word == "-inf") return word == "inf" ? kInfinity : -kInfinity;
  if (word == "nan" || word == "-nan") return std::numeric_limits<double>::quiet_NaN();
  return {};
}

}  // namespace

Result<Layer> parse(std::string_view text) {
  return Parser(text).parse();
}

std::string_view field(std::string_view metadata, std::string_view key) {
  Cursor in(metadata);
  for (in.skip_blanks(); !in.at_end() && !in.failed(); in.skip_blanks()) {
    if (in.peek() == '"' || in.peek() == '\'') {
      in.quoted();
      continue;
    }
    // The key is the last of the words; "prepend", or a type in a dictionary, may stand before it. It may have quotes.
    std::string_view name;
    while (!in.failed() && !in.take('=')) {
      in.skip_blanks();
      const bool is_quoted = in.peek() == '"' || in.peek() == '\'';
      name = is_quoted ? in.quoted() : in.word();
      if (is_quoted && name.size() >= 2) name = name.substr(1, name.size() - 2);
      if (name.empty()) return {};
    }
    const std::string_view value = in.value(true);
    if (name == key) return value;
  }
  return {};
}

std::string_view Attribute::at(double time) const {
  // A sample holds until the next one: values are not interpolated.
  if (samples.empty()) return value;
  const auto after = std::ranges::upper_bound(samples, time, {}, &Sample::time);
  return after == samples.begin() ? after->value : std::prev(after)->value;
}

Attribute attribute(const Prim& prim, std::string_view name) {
  Attribute found;
  for (const Statement& statement : prim.statements) {
    if (statement.name != name) continue;
    if (found.value.empty()) found.value = statement.value;
    if (found.metadata.empty()) found.metadata = statement.metadata;
    if (found.samples.empty()) found.samples = statement.samples;
  }
  std::ranges::stable_sort(found.samples, {}, &Sample::time);
  return found;
}

std::string unquoted(std::string_view value) {
  for (const std::string_view mark : {"\"\"\"", "'''", "@@@", "\"", "'", "@"}) {
    if (value.size() < 2 * mark.size() || !value.starts_with(mark) || !value.ends_with(mark)) continue;
    value = value.substr(mark.size(), value.size() - 2 * mark.size());
    std::string text;
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (value[i] == '\\' && i + 1 < value.size() && mark.front() != '@') ++i;
      text.push_back(value[i]);
    }
    return text;
  }
  if (value.size() >= 2 && value.front() == '<' && value.back() == '>') value = value.substr(1, value.size() - 2);
  return std::string(value);
}

std::vector<std::string> strings(std::string_view value) {
  if (!value.starts_with('[')) return value.empty() ? std::vector<std::string>{} : std::vector{unquoted(value)};
  // The brackets were balanced when the value was found, so the last character is the closing one.
  std::vector<std::string> found;
  Cursor in(value.substr(1, value.size() - 2));
  for (in.skip_blanks(); !in.at_end() && !in.failed(); in.skip_blanks()) {
    const std::string_view one = in.value(true);
    if (!in.failed()) found.push_back(unquoted(one));
  }
  return found;
}

std::optional<std::vector<double>> numbers(std::string_view value) {
  std::vector<double> found;
  const bool is_whole = each_word(value, [&](std::string_view word) {
    if (is_bracket(word)) return true;
    const std::optional<double> number = real(word);
    if (number) found.push_back(*number);
    return number.has_value();
  });
  if (!is_whole) return {};
  return found;
}

std::optional<std::vector<std::int64_t>> integers(std::string_view value) {
  std::vector<std::int64_t> found;
  const bool is_whole = each_word(value, [&](std::string_view word) {
    if (is_bracket(word)) return true;
    const std::optional<std::int64_t> number = parse_number<std::int64_t>(word);
    if (number) found.push_back(*number);
    return number.has_value();
  });
  if (!is_whole) return {};
  return found;
}

std::optional<std::vector<Vec3f>> triples(std::string_view value) {
  std::vector<Vec3f> found;
  int axis = 0;
  const bool is_whole = each_word(value, [&](std::string_view word) {
    if (is_bracket(word)) return axis == 0;
    const std::optional<double> number = real(word);
    if (!number) return false;
    if (axis == 0) found.emplace_back();
    found.back()[axis] = static_cast<float>(*number);
    axis = (axis + 1) % 3;
    return true;
  });
  if (!is_whole || axis != 0) return {};
  return found;
}

}  // namespace hairnet::usda
