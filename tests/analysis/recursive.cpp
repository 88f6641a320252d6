// Breaks the rules on purpose: a checker that cannot fail shows nothing.
static int depth(int n);
static int other(int n) {
  return depth(n - 1);
}
static int depth(int n) {
  return n <= 0 ? 0 : 1 + other(n);
}
int main() {
  return depth(3);
}
