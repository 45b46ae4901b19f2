from bodyplan.cli import main

main()
