"""Where the machine can print: its volume and margins, and where a program sits inside them."""
