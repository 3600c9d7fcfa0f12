# Doxygen's filter of our headers: makes documentation of their plain comments, and keeps every line in its place.
#   // text above a declaration                       /** text */
#   int count;  // text                               int count;  ///< text
#   struct Name {  // text                            /** text */ struct Name {
#   // text above a namespace, or alone in one        /** @file in the blank line before it, and text */
# Lines that are indented by two or more spaces within a comment are set as they are (formulas, tables). Comments in
# functions, above `public:` and alone in a class stay plain.

# Where the comment of a line begins, or 0. A "//" within quotes is none.
function comment_at(line,    i, quoted, c) {
  for (i = 1; i <= length(line); ++i) {
    c = substr(line, i, 1)
    if (c == "\\") ++i
    else if (c == "\"") quoted = !quoted
    else if (!quoted && substr(line, i, 2) == "//") return i
  }
  return 0
}

# Follows braces: a scope is the inside of a namespace, class or enum; all other braces are bodies or initializers.
function follow(code,    i, c, head) {
  gsub(/"([^"\\]|\\.)*"|'([^'\\]|\\.)'/, "", code)
  for (i = 1; i <= length(code); ++i) {
    c = substr(code, i, 1)
    if (c == "{") {
      head = " " statement
      is_scope[++depth] = head ~ /[^A-Za-z0-9_](namespace|struct|class|union|enum)[^A-Za-z0-9_]/ && head !~ /[(=]/
      is_namespace[depth] = head ~ /[^A-Za-z0-9_]namespace[^A-Za-z0-9_]/
      if (!is_scope[depth]) ++bodies
      statement = ""
    } else if (c == "}") {
      if (depth > 0 && !is_scope[depth--]) --bodies
      statement = ""
    } else if (c == ";") statement = ""
    else statement = statement c
  }
  statement = statement " "
}

# One comment line as documentation. The dot of "eq. 7" does not end the brief first sentence.
function text_of(line) {
  sub(/^ *\/\/ ?/, "", line)
  gsub(/eq\. /, "eq.\\ ", line)
  return line
}
function is_set(line) { return line ~ /^ *\/\/   *[^ ]/ }

# Prints the blank line and the comment that wait for what follows them.
function print_plain(    i) {
  if (blank) print ""
  for (i = 1; i <= waiting; ++i) print comment[i]
  blank = waiting = 0
}
function print_documentation(of_file,    i, text, starts, indent) {
  if (blank) print of_file ? "/** @file" : ""
  for (i = 1; i <= waiting; ++i) {
    text = text_of(comment[i])
    if (is_set(comment[i])) {
      starts = i == 1 || !is_set(comment[i - 1])
      if (starts) {
        match(text, /^ */)
        indent = RLENGTH
      }
      text = (starts ? "@verbatim " : "") substr(text, indent + 1)
      if (i == waiting || !is_set(comment[i + 1])) text = text " @endverbatim"
    }
    print (i == 1 && !of_file ? "/** " : "") text (i == waiting ? " */" : "")
  }
  blank = waiting = 0
}

/^ *\/\// && bodies == 0 {
  if (waiting == 0 && trailing_at > 0 && comment_at($0) == trailing_at) {  # goes on from the end of the line above
    print "///< " text_of($0)
    next
  }
  trailing_at = 0
  comment[++waiting] = $0
  next
}

/^ *$/ {
  in_namespace = depth == 0 || is_namespace[depth]
  if (waiting > 0 && blank && in_namespace && depth > 0) print_documentation(1)
  else print_plain()
  blank = 1
  trailing_at = 0
  next
}

{
  at = comment_at($0)
  code = at ? substr($0, 1, at - 1) : $0
  text = at ? substr($0, at) : ""
  sub(/ +$/, "", code)
  trailing_at = 0

  if (waiting == 0 || bodies > 0 || code ~ /^ *(#|}|public:|protected:|private:)/) print_plain()
  else print_documentation(blank && code ~ /^ *namespace[ {]/)

  if (code ~ /^ *#/) {
    print
    next
  }
  follow(code)
  if (text == "" || bodies > 0 || code ~ /^ *}?;?$/ || code ~ /:$/ || code ~ /^ *namespace[ {]/) {
    print
  } else if (code ~ /{$/) {
    print "/** " text_of(text) " */ " code
  } else {
    print code "  ///< " text_of(text)
    trailing_at = at
  }
}

END { print_plain() }
