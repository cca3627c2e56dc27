/* What does the device do all day? */
#include "board.h"
#include "receive.h"
#include "run.h"
#include "talk.h"

int main(void)
{
    board_start();
    run_wake();
    for (;;) {
        board_alive();
        receive();
        run_watch();
        if (!talk())
            board_rest();
    }
}
