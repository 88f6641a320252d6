// Breaks the rules on purpose.
int main() {
  const int* const one = new int(1);
  return *one;
}
