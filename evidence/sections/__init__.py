"""How many contact points and sections a rigid damper needs: the example of two blades with 1 to 15 sections and 2 to 9 lines."""
