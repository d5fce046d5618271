; 2:7: a '(' with no ')' after it | comments in parentheses end in the same line and hold no other; or use ';'
G1 X5 (left F600
