// Reads SWC files, folders or zip archives and lists what is wrong with them.
//
//   wrong INPUT...
#include <filiform/index/input/input.h>
#include <filiform/index/text.h>

#include <exception>
#include <iostream>
#include <string>
#include <vector>

namespace {

void list(const std::string& file, const filiform::InputReport& report) {
  for (const filiform::InputRecord& record : report.records)
    std::cout << filiform::escaped(file) << ':' << record.line << ": " << name(record.code) << ", "
              << explanation(record.code) << (record.token.empty() ? "" : ": ") << record.token << '\n';
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    std::cerr << "usage: wrong INPUT...\n";
    return 2;
  }
  try {
    filiform::Input input(std::vector<std::string>(arguments + 1, arguments + count));
    filiform::Cell cell;
    std::size_t cells = 0;
    while (input.next(cell)) ++cells;  // holds one cell in memory at a time

    for (const filiform::SourceReport& source : input.reports()) {
      list(source.file, source.report);
      for (const filiform::EntryReport& entry : source.entries) list(source.file + "/" + entry.entry, entry.report);
    }
    std::cout << cells << " cells, " << name(filiform::verdict(input.reports())) << '\n';
  } catch (const std::exception& error) {
    std::cerr << "wrong: " << error.what() << '\n';
    return 1;
  }
}
