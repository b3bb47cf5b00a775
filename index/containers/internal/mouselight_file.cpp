#include "index/containers/internal/mouselight_file.h"

#include "index/file/internal/byte_stream.h"
#include "index/file/internal/file_parts.h"
#include "index/formats/swc/internal/text_sniff.h"
#include "index/text.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace filiform {
namespace {

struct WrongJson {
  std::uint64_t line;
  std::string what;
};

// Follows the structure of JSON without holding it. Throws WrongJson.
class JsonOutline {
 public:
  explicit JsonOutline(internal::ByteStream& in) : in_(in) {}

  std::uint64_t offset() const { return offset_; }  // of the next byte
  [[noreturn]] void fail(const std::string& what) const { throw WrongJson{in_.line(), what}; }

  // The next byte that is no blank, not consumed.
  char peek() {
    int c = in_.peek();
    for (; c == ' ' || (c >= '\t' && c <= '\r'); c = in_.peek()) get();
    if (c == internal::ByteStream::kEnd) fail("ends inside a list or an object; is the file cut short?");
    return static_cast<char>(c);
  }
  bool atEnd() {
    for (int c = in_.peek(); c != internal::ByteStream::kEnd; c = in_.peek()) {
      if (c != ' ' && !(c >= '\t' && c <= '\r')) return false;
      get();
    }
    return true;
  }
  void skipMark() {
    if (!in_.head(3).starts_with("\xEF\xBB\xBF")) return;
    for (int i = 0; i < 3; ++i) get();
  }
  void expect(char wanted) {
    if (peek() != wanted) fail(std::string("not valid JSON: '") + wanted + "' is missing");
    get();
  }
  bool take(char wanted) {
    if (peek() != wanted) return false;
    get();
    return true;
  }

  // Reads a string, cut at kMostText bytes. Escapes of single characters are resolved, others kept.
  std::string text() {
    expect('"');
    std::string read;
    for (;;) {
      int c = get();
      if (c == '"') return read;
      if (c == '\\') {
        c = get();
        if (c != '"' && c != '\\' && c != '/') put('\\', read);
      }
      if (c == internal::ByteStream::kEnd) fail("ends inside a text; is the file cut short?");
      put(static_cast<char>(c), read);
    }
  }

  // Calls `use(key)` at each value of an object; `use` must consume it.
  template <class Use>
  void object(Use use) {
    expect('{');
    if (take('}')) return;
    do {
      const std::string key = text();
      expect(':');
      use(key);
    } while (take(','));
    expect('}');
  }

  // Calls `use()` at each element of a list; `use` must consume it.
  template <class Use>
  void list(Use use) {
    expect('[');
    if (take(']')) return;
    do use();
    while (take(','));
    expect(']');
  }

  void skip() {
    std::uint64_t open = 0;
    do {
      const char c = peek();
      if (c == '"') {
        text();
      } else if (c == '{' || c == '[') {
        ++open;
        get();
      } else if (c == '}' || c == ']') {
        if (open == 0) fail("not valid JSON: a value is missing");
        --open;
        get();
      } else if (open > 0 && (c == ',' || c == ':')) {
        get();
      } else {
        skipScalar();
      }
    } while (open > 0);
  }

 private:
  static constexpr std::size_t kMostText = 256;

  int get() {
    const int c = in_.get();
    offset_ += c != internal::ByteStream::kEnd;
    return c;
  }
  static void put(char c, std::string& read) {
    if (read.size() < kMostText) read += c;
  }
  void skipScalar() {
    std::uint64_t length = 0;
    for (int c = in_.peek(); c != internal::ByteStream::kEnd; c = in_.peek(), ++length) {
      const bool part = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '+' ||
                        c == '-' || c == '.';
      if (!part) break;
      get();
    }
    if (length == 0) fail("not valid JSON: a value is missing");
  }

  internal::ByteStream& in_;
  std::uint64_t offset_ = 0;
};

class NeuronFinder {
 public:
  explicit NeuronFinder(internal::ByteStream& in) : json_(in) {}

  std::vector<ArchiveEntry> find() {
    json_.skipMark();
    if (json_.atEnd()) json_.fail("holds nothing");
    if (json_.peek() == '[') {
      json_.list([&] { neuron(); });
    } else if (json_.peek() == '{') {
      whole();
    } else {
      json_.fail("not JSON: must begin with '{'");
    }
    if (!json_.atEnd()) json_.fail("not valid JSON: something follows its end");
    return std::move(found_);
  }

 private:
  void whole() {
    const std::uint64_t begin = json_.offset();
    bool any_list = false, is_neuron = false;
    std::string name;
    const std::function<void(const std::string&)> use = [&](const std::string& key) {
      if (key == "neurons" && json_.peek() == '[') {
        any_list = true;
        json_.list([&] { neuron(); });
      } else if (key == "contents" && json_.peek() == '{') {  // as the API wraps them
        json_.object([&](const std::string& inner) {
          if (inner == "neurons")
            use(inner);
          else
            json_.skip();
        });
      } else {
        is_neuron = is_neuron || key == "axon" || key == "dendrite";
        member(key, name);
      }
    };
    json_.object(use);
    if (any_list) return;
    if (!is_neuron) json_.fail("not MouseLight JSON: it has no list `neurons`, `axon` or `dendrite`");
    add(begin, name);
  }

  void neuron() {
    if (json_.peek() != '{') json_.fail("not MouseLight JSON: a neuron must be an object");
    const std::uint64_t begin = json_.offset();
    std::string name;
    json_.object([&](const std::string& key) { member(key, name); });
    add(begin, name);
  }

  void member(const std::string& key, std::string& name) {
    if (key == "idString" && json_.peek() == '"') {
      name = json_.text();
    } else {
      json_.skip();
    }
  }

  void add(std::uint64_t begin, std::string name) {
    ArchiveEntry entry;
    if (name.empty()) name = "neuron " + std::to_string(found_.size() + 1);
    entry.index = begin;
    entry.bytes = entry.packed_bytes = json_.offset() - begin;
    entry.format = GraphFormat::kMouseLight;
    std::string label = escaped(name);
    std::replace(label.begin(), label.end(), '/', '_');
    if (label != name) entry.label = std::move(label);
    entry.name = std::move(name);
    found_.push_back(std::move(entry));
  }

  JsonOutline json_;
  std::vector<ArchiveEntry> found_;
};

class NeuronReader final : public Container::Reader {
 public:
  NeuronReader(std::string path, std::uint64_t bytes) : path_(std::move(path)), bytes_(bytes) {}

  std::optional<InputCode> read(const ArchiveEntry& entry, const Sink& sink) override {
    if (!file_) file_.emplace(path_, bytes_);
    file_->pass(entry.index, entry.bytes, sink);
    return std::nullopt;
  }

 private:
  const std::string path_;
  const std::uint64_t bytes_;
  std::optional<internal::FileParts> file_;
};

}  // namespace

MouseLightFile::MouseLightFile(std::string path, const std::function<void(std::uint64_t)>& progress)
    : path_(std::move(path)) {
  internal::ByteStream in(path_, [&](std::uint64_t bytes) {
    file_bytes_ += bytes;
    if (progress) progress(bytes);
  });
  const std::string_view head = in.head(4096);
  const bool binary = internal::hasBinaryMagic(head), wide = internal::isWideText(head);
  try {
    if (binary || wide) {
      refuse(binary ? InputCode::E_NOT_TEXT : InputCode::E_ENCODING);
    } else {
      entries_ = NeuronFinder(in).find();
      finishListing();
    }
  } catch (const WrongJson& wrong) {
    refuse(InputCode::E_FORMAT, "line " + std::to_string(wrong.line) + ": " + wrong.what);
  }
  digest_ = in.digest();
}

std::unique_ptr<Container::Reader> MouseLightFile::reader() const {
  return std::make_unique<NeuronReader>(path_, file_bytes_);
}

}  // namespace filiform
