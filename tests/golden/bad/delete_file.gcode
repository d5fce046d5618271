; 2:1: M30 'pot.gco': this machine has no files to delete | M30 alone ends the program
M30 pot.gco
